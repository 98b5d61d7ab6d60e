// SPDX-License-Identifier: MIT
// Textures: charts do not overlap, every face has its texels, colours are those of the place on the
// surface, and photos are chosen by angle, distance and what hides what.
#include "engine/mesh/texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "engine/core/error.h"
#include "engine/mesh/topology.h"
#include "engine/mesh/tsdf.h"
#include "tests/support/mesh_shapes.h"

namespace darb::test {
namespace {

using glm::dvec3;

glm::u8vec3 colour_at(const glm::vec3& p) {
    return glm::u8vec3(glm::round(127.5f + 80.0f * glm::clamp(p, -1.5f, 1.5f)));
}

const ColourSource kByPlace = [](std::span<const SurfacePoint> points,
                                 std::span<glm::u8vec3> colours) {
    for (std::size_t i = 0; i < points.size(); ++i) colours[i] = colour_at(points[i].position);
};

/// The colour of a page at uv, between the middles of texels.
dvec3 seen_at(const ImageU8& page, const glm::dvec2& uv) {
    const double x = std::clamp(uv.x * page.width - 0.5, 0.0, page.width - 1.0),
                 y = std::clamp(uv.y * page.height - 0.5, 0.0, page.height - 1.0);
    const int x0 = std::min(int(x), page.width - 2), y0 = std::min(int(y), page.height - 2);
    dvec3 colour;
    for (int c = 0; c < 3; ++c)
        colour[c] = glm::mix(
            glm::mix(double(page.at(x0, y0, c)), double(page.at(x0 + 1, y0, c)), x - x0),
            glm::mix(double(page.at(x0, y0 + 1, c)), double(page.at(x0 + 1, y0 + 1, c)), x - x0),
            y - y0);
    return colour;
}

/// The largest difference between the texture and the colours of the places, over points of faces.
double worst_error(const TriangleMesh& mesh, const MeshTexture& texture) {
    double worst = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (const dvec3& w : {dvec3(1, 0, 0), dvec3(0, 1, 0), dvec3(0.4, 0.4, 0.2),
                               dvec3(0.5, 0, 0.5), dvec3(1.0 / 3)}) {
            dvec3 p(0.0);
            glm::dvec2 uv(0.0);
            for (std::size_t c = 0; c < 3; ++c) {
                p += w[int(c)] * dvec3(mesh.position[mesh.face[f][c]]);
                uv += w[int(c)] * glm::dvec2(texture.uv[f][c]);
            }
            const dvec3 error = glm::abs(seen_at(texture.image[texture.page[f]], uv) -
                                         dvec3(colour_at(glm::vec3(p))));
            worst = std::max({worst, error.x, error.y, error.z});
        }
    return worst;
}

TEST(UnwrapMesh, charts_keep_lengths_and_do_not_overlap) {
    const TriangleMesh mesh = torus_mesh(1, 0.4, 40, 24);
    const AtlasOptions options{.texel = 0.02, .page_side = 256};
    const MeshTexture texture = unwrap_mesh(mesh, options);
    ASSERT_EQ(texture.uv.size(), mesh.face_count());
    EXPECT_GT(texture.image.size(), 1u);
    std::set<std::array<int, 3>> used;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const ImageU8& page = texture.image.at(texture.page[f]);
        EXPECT_LE(page.width, 256);
        EXPECT_LE(page.height, 256);
        glm::dvec2 at[3];
        for (std::size_t c = 0; c < 3; ++c) {
            at[c] = glm::dvec2(texture.uv[f][c]) * glm::dvec2(page.width, page.height);
            EXPECT_GE(std::min(at[c].x, at[c].y), 3.999) << "a gutter";
            EXPECT_LE(at[c].x, page.width - 3.999);
            EXPECT_LE(at[c].y, page.height - 3.999);
        }
        // Along an axis nothing is longer than on the surface, nor less than 1/sqrt(3) in area.
        const glm::dvec2 a = at[1] - at[0], b = at[2] - at[0];
        const double flat = (a.x * b.y - a.y * b.x) * options.texel * options.texel;
        const double area = glm::length(face_cross(mesh, f));
        EXPECT_GT(flat, 0.57 * area) << "face " << f << " is mirrored or squeezed";
        EXPECT_LT(flat, 1.001 * area) << f;
        // Middles of texels well within a face are within no other.
        const glm::dvec2 middle = (at[0] + at[1] + at[2]) / 3.0;
        const glm::dvec2 texel = glm::floor(middle);
        const glm::dvec2 p = texel + 0.5;
        bool within = true;
        for (int c = 0; c < 3; ++c) {
            const glm::dvec2 u = at[(c + 1) % 3] - at[c], v = p - at[c];
            within &= u.x * v.y - u.y * v.x > 0.05 * glm::length(u);
        }
        if (within) {
            EXPECT_TRUE(used.insert({int(texture.page[f]), int(texel.x), int(texel.y)}).second)
                << "face " << f << " shares a texel";
        }
    }
    EXPECT_GT(used.size(), 100u);
}

TEST(UnwrapMesh, a_spiral_does_not_cover_itself) {
    // A ramp that turns twice around: all of it faces up, and its second turn is over its first.
    TriangleMesh ramp;
    constexpr std::uint32_t kSteps = 48;
    for (std::uint32_t i = 0; i <= kSteps; ++i)
        for (const double r : {0.6, 1.0}) {
            const double a = 4 * std::numbers::pi * i / kSteps;
            ramp.position.emplace_back(r * std::cos(a), r * std::sin(a), 0.1 * a);
        }
    for (std::uint32_t i = 0; i < kSteps; ++i) {
        ramp.face.push_back({2 * i, 2 * i + 1, 2 * i + 3});
        ramp.face.push_back({2 * i, 2 * i + 3, 2 * i + 2});
    }
    MeshTexture texture = unwrap_mesh(ramp, {.texel = 0.01});
    paint_texture(ramp, kByPlace, 4, texture);
    EXPECT_LT(worst_error(ramp, texture), 3) << "where turns share texels it is off by 100";
}

TEST(UnwrapMesh, a_face_larger_than_a_page_is_refused_with_a_texel_that_works) {
    const TriangleMesh mesh = square_mesh(10, 1);
    try {
        unwrap_mesh(mesh, {.texel = 0.01, .page_side = 256});
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_NE(error.reason.find("1000 x 1000 texels"), std::string::npos) << error.what();
        const std::size_t at = error.hint.find_first_of("0123456789");
        const double texel = std::stod(error.hint.substr(at));
        EXPECT_EQ(unwrap_mesh(mesh, {.texel = texel, .page_side = 256}).image.size(), 1u);
    }
    EXPECT_THROW(
        unwrap_mesh(square_mesh(10, 40), {.texel = 0.01, .page_side = 256, .most_pages = 3}),
        Error);
}

TEST(PaintTexture, shows_the_colour_of_every_place) {
    for (const TriangleMesh& mesh :
         {torus_mesh(1, 0.4, 40, 24), box_mesh(glm::vec3(-0.5f), glm::vec3(0.7f, 0.5f, 0.9f)),
          sphere_mesh(0.8, 60, 80)}) {
        MeshTexture texture = unwrap_mesh(mesh, {.texel = 0.01, .page_side = 512});
        paint_texture(mesh, kByPlace, 4, texture);
        // A texel is 0.01 to 0.018 on the surface, its half 0.7 to 1.4 of a colour's 80 a unit; two
        // roundings; gutters repeat their neighbour, up to a texel away.
        EXPECT_LT(worst_error(mesh, texture), 4);
    }
    // Faces far smaller than a texel get their own colour.
    TriangleMesh tiny = sphere_mesh(0.8, 60, 80);
    for (glm::vec3& p : tiny.position) p = glm::vec3(1) + 0.01f * p;
    MeshTexture texture = unwrap_mesh(tiny, {.texel = 0.05});
    paint_texture(tiny, kByPlace, 4, texture);
    EXPECT_LT(worst_error(tiny, texture), 3);
}

TEST(PaintTexture, normals_are_unit_and_of_the_place) {
    const TriangleMesh mesh = sphere_mesh(1, 30, 40);
    MeshTexture texture = unwrap_mesh(mesh, {.texel = 0.03});
    std::size_t points = 0;
    paint_texture(
        mesh,
        [&](std::span<const SurfacePoint> list, std::span<glm::u8vec3>) {
            for (const SurfacePoint& point : list) {
                EXPECT_NEAR(glm::length(point.normal), 1, 1e-5);
                EXPECT_GT(glm::dot(point.normal, glm::normalize(point.position)), 0.999f);
                ASSERT_LT(point.face, mesh.face_count());
                ++points;
            }
        },
        0, texture);
    EXPECT_GT(double(points) * 0.03 * 0.03, 0.6 * 4 * std::numbers::pi);
}

Camera camera_at(const dvec3& eye, const dvec3& target) {
    const dvec3 forward = glm::normalize(target - eye);
    const dvec3 right = glm::normalize(glm::cross(forward, dvec3(0, 0.01, 1)));
    Camera camera;
    camera.width = 200;
    camera.height = 150;
    camera.fx = camera.fy = 160;
    camera.cx = 100;
    camera.cy = 75;
    camera.rotation = glm::transpose(glm::dmat3(right, glm::cross(forward, right), forward));
    camera.translation = -(camera.rotation * eye);
    return camera;
}

/// Cameras above a square of side 2 around 0: one upright, one oblique, one nearer over a corner.
PhotoViews views_of_square() {
    PhotoViews views;
    views.cameras = {camera_at({0, 0, 3}, {0, 0, 0}), camera_at({5, 0, 3}, {0, 0, 0}),
                     camera_at({0.6, 0.6, 1.4}, {0.6, 0.6, 0})};
    views.sees = [](std::size_t, const dvec3&) { return true; };
    views.photo = [&](std::size_t view) {
        ImageU8 photo(200, 150, 3);
        for (int y = 0; y < photo.height; ++y)
            for (int x = 0; x < photo.width; ++x) {
                photo.at(x, y, 0) = static_cast<std::uint8_t>(50 * (view + 1));
                photo.at(x, y, 1) = static_cast<std::uint8_t>(x);
                photo.at(x, y, 2) = static_cast<std::uint8_t>(y);
            }
        return photo;
    };
    return views;
}

TriangleMesh square_around_0(std::uint32_t cells) {
    TriangleMesh mesh = square_mesh(2, cells);
    for (glm::vec3& p : mesh.position) p -= glm::vec3(1, 1, 0);
    return mesh;
}

TEST(ChoosePhotos, takes_the_nearest_upright_view_that_sees_the_face) {
    const TriangleMesh mesh = square_around_0(16);
    PhotoViews views = views_of_square();
    const PhotoChoice choice = choose_photos(mesh, views, 0);
    EXPECT_EQ(choice.unseen, 0u);
    EXPECT_EQ(choice.view[2 * (8 * 16 + 2)], 0u);
    EXPECT_EQ(choice.view[2 * (12 * 16 + 12)], 2u) << "the nearer one";
    EXPECT_EQ(std::count(choice.view.begin(), choice.view.end(), 1u), 0);
    // What the depth map of the nearer one hides goes to the next best.
    views.sees = [](std::size_t view, const dvec3& p) { return view != 2 || p.x < 0.5; };
    const PhotoChoice hidden = choose_photos(mesh, views, 0);
    EXPECT_EQ(hidden.view[2 * (12 * 16 + 12)], 0u);
    views.sees = [](std::size_t, const dvec3& p) { return p.y < 0; };
    EXPECT_EQ(choose_photos(mesh, views, 0).unseen, mesh.face_count() / 2);
    // From below nobody sees it.
    TriangleMesh below = mesh;
    for (auto& face : below.face) std::swap(face[0], face[1]);
    EXPECT_EQ(choose_photos(below, views_of_square(), 0).unseen, mesh.face_count());
}

TEST(ChoosePhotos, smoothing_leaves_fewer_seams) {
    const TriangleMesh mesh = square_around_0(32);
    PhotoViews views = views_of_square();
    views.cameras.push_back(camera_at({0.5, 0, 3}, {0, 0, 0}));
    // It is hardly better than the first on one side, and its depth map has gaps.
    views.sees = [](std::size_t view, const dvec3& p) {
        return view != 3 || std::fmod(std::abs(std::sin(91 * p.x + 57 * p.y)) * 100, 1.0) > 0.2;
    };
    const PhotoChoice rough = choose_photos(mesh, views, 0), smooth = choose_photos(mesh, views, 1);
    EXPECT_GT(rough.seams, 200u);
    EXPECT_LT(double(smooth.seams), 0.4 * double(rough.seams));
    EXPECT_EQ(choose_photos(mesh, views, 1).view, smooth.view);
}

// Noise turns the normals of single faces, but those of vertices less.
TEST(ChoosePhotos, noise_in_the_surface_leaves_few_seams) {
    TriangleMesh mesh = square_around_0(48);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        mesh.position[v].z = 0.015f * std::sin(91.7f * static_cast<float>(v));
    PhotoViews views = views_of_square();
    for (const double x : {-2.0, -0.7, 0.7, 2.0})
        views.cameras.push_back(camera_at({x, 0.3, 3}, {0, 0, 0}));
    views.sees = [](std::size_t, const dvec3&) { return true; };
    const std::size_t by_faces = choose_photos(mesh, views).seams;
    set_normals(mesh);
    const std::size_t by_vertices = choose_photos(mesh, views).seams;
    EXPECT_GT(by_faces, 0u);
    EXPECT_LT(double(by_vertices), 0.8 * double(by_faces));
}

TEST(PaintWithPhotos, texels_are_what_the_photo_shows_there) {
    TriangleMesh mesh = square_around_0(16);
    mesh.origin = {100, 0, 0};
    PhotoViews views = views_of_square();
    for (Camera& camera : views.cameras) camera.translation -= camera.rotation * dvec3(100, 0, 0);
    const PhotoChoice choice = choose_photos(mesh, views);
    MeshTexture texture = unwrap_mesh(mesh, {.texel = 0.02});
    paint_with_photos(mesh, views, choice, {}, 4, texture);
    for (std::size_t f = 0; f < mesh.face_count(); f += 7) {
        const std::size_t view = choice.view[f];
        ASSERT_NE(view, kNoPhoto);
        dvec3 p(100, 0, 0);
        glm::dvec2 uv(0.0);
        for (std::size_t c = 0; c < 3; ++c) {
            p += dvec3(mesh.position[mesh.face[f][c]]) / 3.0;
            uv += glm::dvec2(texture.uv[f][c]) / 3.0;
        }
        const Camera& camera = views.cameras[view];
        const dvec3 local = camera.rotation * p + camera.translation;
        const dvec3 seen = seen_at(texture.image[0], uv);
        EXPECT_NEAR(seen.x, 50.0 * double(view + 1), 60) << "may border another photo";
        if (std::abs(seen.x - 50.0 * double(view + 1)) > 0.5) continue;
        EXPECT_NEAR(seen.y, 160 * local.x / local.z + 100 - 0.5, 1.1) << f;
        EXPECT_NEAR(seen.z, 160 * local.y / local.z + 75 - 0.5, 1.1) << f;
    }
    // Without a photo: vertices' colours, else grey.
    PhotoChoice none = choice;
    std::fill(none.view.begin(), none.view.end(), kNoPhoto);
    paint_with_photos(mesh, views, none, {}, 4, texture);
    EXPECT_EQ(texture.image[0].at(30, 30, 1), 128);
    mesh.colour.assign(mesh.vertex_count(), glm::u8vec3(1, 2, 3));
    paint_with_photos(mesh, views, none, {}, 4, texture);
    EXPECT_EQ(texture.image[0].at(30, 30, 1), 2);
}

/// Two photos from above, one of the left half of a square and one of the right half: grey that
/// brightens along y. `by` is added to the right one.
struct Halves {
    TriangleMesh mesh = square_around_0(32);
    PhotoViews views = views_of_square();
    PhotoChoice choice;

    explicit Halves(int by) {
        views.cameras.resize(2);
        views.cameras[1] = views.cameras[0];
        views.photo = [by](std::size_t view) {
            ImageU8 photo(200, 150, 3);
            for (int y = 0; y < photo.height; ++y)
                for (int x = 0; x < photo.width; ++x)
                    for (int c = 0; c < 3; ++c)
                        photo.at(x, y, c) =
                            static_cast<std::uint8_t>(60 + y / 2 + (view == 1 ? by * (c + 1) : 0));
            return photo;
        };
        for (const auto& face : mesh.face) {
            float x = 0;
            for (const std::uint32_t v : face) x += mesh.position[v].x;
            choice.view.push_back(x < 0 ? 0 : 1);
        }
    }
};

TEST(LevelSeams, photos_of_two_exposures_meet) {
    const Halves halves(12);
    const SeamLevels levels = level_seams(halves.mesh, halves.views, halves.choice);
    EXPECT_NEAR(levels.before, 24, 0.5) << "12, 24 and 36 in the three colours";
    EXPECT_LT(levels.after, 0.05 * levels.before);
    EXPECT_EQ(level_seams(halves.mesh, halves.views, halves.choice).added, levels.added);
    double steepest = 0;
    for (const auto& corners : levels.added)
        for (std::size_t c = 0; c < 3; ++c)
            steepest = std::max(steepest, double(std::abs(corners[c].z - corners[(c + 1) % 3].z)));
    EXPECT_LT(steepest, 3) << "36 levels spread over the faces of both photos";

    MeshTexture texture = unwrap_mesh(halves.mesh, {.texel = 0.02});
    MeshTexture raw = texture;
    paint_with_photos(halves.mesh, halves.views, halves.choice, levels, 4, texture);
    paint_with_photos(halves.mesh, halves.views, halves.choice, {}, 4, raw);
    const auto step = [](const ImageU8& page) {  // across the middle, at half the height
        const int x = page.width / 2, y = page.height / 2;
        return std::abs(page.at(x + 1, y, 2) - page.at(x - 2, y, 2));
    };
    EXPECT_NEAR(step(raw.image[0]), 36, 1);
    EXPECT_LE(step(texture.image[0]), 3);
}

TEST(LevelSeams, photos_that_agree_stay_as_they_are) {
    const Halves halves(0);
    const SeamLevels levels = level_seams(halves.mesh, halves.views, halves.choice);
    EXPECT_LT(levels.before, 1e-9);
    for (const auto& corners : levels.added)
        for (const glm::vec3& added : corners) EXPECT_LT(glm::length(added), 1e-6f);
    // A mesh of one photo, and one of none, have no seams.
    PhotoChoice one = halves.choice;
    for (const std::uint32_t view : {0u, kNoPhoto}) {
        std::fill(one.view.begin(), one.view.end(), view);
        EXPECT_TRUE(level_seams(halves.mesh, halves.views, one).added.empty());
    }
    PhotoChoice shorter = halves.choice;
    shorter.view.pop_back();
    EXPECT_THROW(level_seams(halves.mesh, halves.views, shorter), Error);
}

// What differs by more than exposures do is another thing in the photo, and bends less.
TEST(LevelSeams, large_differences_count_less) {
    const Halves halves(12);
    Halves torn(12);
    const auto photo = torn.views.photo;
    torn.views.photo = [photo](std::size_t view) {
        ImageU8 torn_photo = photo(view);
        if (view == 1)  // a tenth of the seam shows something white
            for (int y = 70; y < 80; ++y)
                for (int x = 0; x < torn_photo.width; ++x)
                    for (int c = 0; c < 3; ++c) torn_photo.at(x, y, c) = 255;
        return torn_photo;
    };
    const SeamLevels clean = level_seams(halves.mesh, halves.views, halves.choice);
    const SeamLevels bent = level_seams(torn.mesh, torn.views, torn.choice);
    // Far along the seam the levels hardly change.
    EXPECT_NEAR(bent.added[0][0].x, clean.added[0][0].x, 5)
        << "of the 110 by which the photos differ there";
    EXPECT_GT(bent.after, 2);
}

}  // namespace
}  // namespace darb::test
