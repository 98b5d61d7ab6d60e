// SPDX-License-Identifier: MIT
// Pictures that are made of several: orthophotos by their geometry, and blur by its mean.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/rng.h"
#include "engine/render/camera_blur.h"
#include "engine/render/orthophoto.h"
#include "tests/support/splat_files.h"

namespace darb {
namespace {

/// Splats spread evenly over a box of 10 x 6 x 2 around (100, 200, 5).
SplatModel box_of_splats() {
    SplatModel model;
    Pcg32 rng(3);
    for (int i = 0; i < 4000; ++i) {
        for (const double at :
             {100 + rng.uniform(-5, 5), 200 + rng.uniform(-3, 3), 5 + rng.uniform(-1, 1)})
            model.position.push_back(static_cast<float>(at));
        for (int k = 0; k < 3; ++k) {
            model.log_scale.push_back(-3);
            model.sh_dc.push_back(0);
        }
        for (const float q : {1.0f, 0.0f, 0.0f, 0.0f}) model.rotation.push_back(q);
        model.opacity_logit.push_back(2);
    }
    return model;
}

glm::dvec2 pixel_of(const OrthophotoTile& tile, const glm::dvec3& world) {
    const Camera& c = tile.camera;
    const glm::dvec3 p = c.rotation * world + c.translation;
    return {tile.x + c.cx + c.fx * p.x / p.z, tile.y + c.cy + c.fy * p.y / p.z};
}

TEST(Orthophoto, pixels_are_alike_at_every_place_and_depth) {
    const Orthophoto photo = orthophoto_of(box_of_splats(), {.pixel = 0.005});
    EXPECT_NEAR(photo.width * photo.pixel, 10.4, 0.2);
    EXPECT_NEAR(photo.height * photo.pixel, 6.24, 0.2);
    EXPECT_NEAR(photo.depth, 2.08, 0.1);
    const std::vector<OrthophotoTile> tiles = tiles_of(photo);
    EXPECT_EQ(tiles.size(), 5U * 3U);
    double worst = 0;
    int covered = 0;
    for (const OrthophotoTile& tile : tiles) {
        covered += tile.camera.width * tile.camera.height;
        for (const double x : {0.0, 0.5, 1.0})
            for (const double y : {0.0, 1.0})
                for (const double z : {0.0, 0.5, 1.0}) {
                    const glm::dvec2 px(tile.x + x * tile.camera.width,
                                        tile.y + y * tile.camera.height);
                    const glm::dvec3 world =
                        photo.corner +
                        glm::transpose(photo.axes) * glm::dvec3(px * photo.pixel, z * photo.depth);
                    worst = std::max(worst, glm::distance(pixel_of(tile, world), px));
                    const glm::dvec3 seen = tile.camera.rotation * world + tile.camera.translation;
                    EXPECT_GE(seen.z, tile.near_plane * (1 - 1e-6));
                }
    }
    EXPECT_EQ(covered, photo.width * photo.height);
    EXPECT_LT(worst, 0.15) << "a tenth of a pixel along each side";
    EXPECT_GT(worst, 0.01) << "the test sees a difference where there is one";
}

TEST(Orthophoto, world_files_say_where_pixels_are_on_the_map) {
    const SplatModel model = box_of_splats();
    const Orthophoto above = orthophoto_of(model, {.pixel = 0.5});
    const auto map = world_file(above, {.offset = {1000, 2000, 0}});
    ASSERT_TRUE(map);
    double a, d, b, e, c, f;
    ASSERT_EQ(std::sscanf(map->c_str(), "%lf%lf%lf%lf%lf%lf", &a, &d, &b, &e, &c, &f), 6);
    EXPECT_EQ(a, 0.5);
    EXPECT_EQ(e, -0.5) << "north is up";
    EXPECT_EQ(b, 0);
    EXPECT_EQ(d, 0);
    EXPECT_NEAR(c, 1000 + 100 - 5.2 + 0.25, 0.1) << "the middle of the first pixel";
    EXPECT_NEAR(f, 2000 + 200 + 3.12 - 0.25, 0.1);
    const glm::dvec3 tilted = glm::normalize(glm::dvec3(0, 1, 5));
    const Orthophoto oblique = orthophoto_of(model, {.from = tilted, .pixel = 0.5});
    EXPECT_FALSE(world_file(oblique));
    // On a map whose up is tilted so, it is level, in metres.
    SplatModel placed = model;
    placed.metres_per_unit = 2;
    const glm::dvec3 north = glm::normalize(glm::cross(tilted, glm::dvec3(1, 0, 0)));
    placed.place.rotation = glm::transpose(glm::dmat3(glm::dvec3(1, 0, 0), north, tilted));
    const Orthophoto level =
        orthophoto_of(placed, {.from = tilted, .up = tilted, .north = north, .pixel = 0.5});
    const auto metres = world_file(level, map_of(placed));
    ASSERT_TRUE(metres);
    EXPECT_EQ(metres->substr(0, 9), "1\n0\n0\n-1\n");
}

TEST(Orthophoto, a_side_shows_what_is_up_at_the_top) {
    const Orthophoto side = orthophoto_of(box_of_splats(), {.from = {0, -1, 0}, .pixel = 0.01});
    const glm::dmat3 rows = glm::transpose(side.axes);
    EXPECT_NEAR(glm::distance(rows[0], {1, 0, 0}), 0, 1e-12);
    EXPECT_NEAR(glm::distance(rows[1], {0, 0, -1}), 0, 1e-12);
    EXPECT_NEAR(glm::distance(rows[2], {0, 1, 0}), 0, 1e-12);
    EXPECT_NEAR(glm::determinant(side.axes), 1, 1e-12);
}

TEST(Orthophoto, too_fine_pixels_and_empty_scenes_are_refused) {
    EXPECT_NE(
        test::error_of([] { orthophoto_of(box_of_splats(), {.pixel = 1e-5}); }).find("--pixel"),
        std::string::npos);
    EXPECT_NE(test::error_of([] { orthophoto_of({}, {}); }).find("no splat"), std::string::npos);
}

TEST(CameraBlur, what_is_in_focus_stays_and_the_rest_spreads_over_a_disc) {
    Camera camera;
    camera.fx = camera.fy = 500;
    camera.cx = 320;
    camera.cy = 240;
    const CameraBlur blur{.aperture = 0.1, .focus = 4, .samples = 64};
    double widest = 0;
    glm::dvec2 mean(0.0);
    for (int i = 0; i < blur.samples; ++i) {
        const Camera sample = through_lens(camera, blur, i);
        const auto pixel = [&](const glm::dvec3& world) {
            const glm::dvec3 p = sample.rotation * world + sample.translation;
            return glm::dvec2(sample.cx + sample.fx * p.x / p.z, sample.cy + sample.fy * p.y / p.z);
        };
        EXPECT_NEAR(glm::distance(pixel({1, 0.5, 4}), {445, 302.5}), 0, 1e-9);
        const glm::dvec2 off = pixel({0, 0, 8}) - glm::dvec2(320, 240);
        widest = std::max(widest, glm::length(off));
        mean += off / 64.0;
    }
    EXPECT_NEAR(widest, 500 * 0.1 * (1 / 4.0 - 1 / 8.0), 0.1) << "the circle of confusion";
    EXPECT_LT(glm::length(mean), 0.2);
    EXPECT_EQ(through_lens(camera, {}, 5).cx, camera.cx);
    EXPECT_NEAR(shutter_time({.shutter = 0.02, .samples = 2}, 0), -0.005, 1e-12);
}

TEST(CameraBlur, light_is_averaged_and_not_its_code) {
    ImageU8 black(1, 1, 3), white(1, 1, 3);
    white.data = {255, 255, 255};
    MeanPicture half;
    half.add(black);
    half.add(white);
    EXPECT_EQ(half.mean().data[0], 188) << "half of the light in sRGB";
    ImageU8 grey(1, 1, 3);
    for (int v = 0; v < 256; ++v) {
        grey.data[0] = static_cast<std::uint8_t>(v);
        MeanPicture same;
        for (int i = 0; i < 3; ++i) same.add(grey);
        EXPECT_EQ(same.mean().data[0], v);
    }
    EXPECT_THROW(half.add(ImageU8(2, 1, 3)), Error);
}

}  // namespace
}  // namespace darb
