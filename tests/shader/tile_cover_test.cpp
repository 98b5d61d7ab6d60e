// SPDX-License-Identifier: MIT
// The tiles that project.comp lists for a splat, against every pixel: no tile with a pixel above
// the alpha cut-off is missing, and no listed cell lies outside the ellipse and its slack.
#include <set>

#include "engine/reference/reference_render.h"
#include "tests/support/projected_frame.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

constexpr double kCutoff = ALPHA_CUTOFF_DEFAULT;

struct CoverCounts {
    size_t visible = 0, intersections = 0, reference_intersections = 0, tiles_with_pixels = 0;
};

/// The tiles with a pixel whose alpha, in double, is above the cut-off by more than rounding.
std::set<std::uint32_t> tiles_with_pixels(const reference::ProjectedSplat<double>& s,
                                          const reference::KernelTable& kernel,
                                          const Camera& camera, std::uint32_t tiles_x) {
    std::set<std::uint32_t> tiles;
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            const double dx = s.mean_px.x - x - 0.5, dy = s.mean_px.y - y - 0.5;
            const double u = s.l11 * dx + s.l21 * dy, v = s.l22 * dy;
            const double q = u * u + v * v;
            if (q < s.reach && s.opacity * kernel.value(q) >= kCutoff * (1 + 1e-4))
                tiles.insert(static_cast<std::uint32_t>(y / TILE_SIZE) * tiles_x + x / TILE_SIZE);
        }
    return tiles;
}

CoverCounts expect_cover_exact(const SplatModel& model, const Camera& camera) {
    const ProjectedFrame frame = project_on_device(model, camera);
    const auto& kernel = reference::kernel_table(model.kernel, model.footprint);
    const reference::RenderResult truth = reference::render(model, camera, {});
    const auto tiles_x = static_cast<std::uint32_t>(truth.tiles.tiles_x);
    CoverCounts counts;
    counts.reference_intersections = truth.tiles.intersection_count();
    for (size_t i = 0; i < model.size(); ++i) {
        const auto& s = truth.projected[i];
        if (frame.visible[i] == 0) {
            EXPECT_NE(s.cull, reference::Cull::none) << "splat " << i;
            continue;
        }
        ++counts.visible;
        counts.intersections += frame.intersection_count[i];
        const std::vector<std::uint32_t> tiles = cover_tiles(frame.cover[i], tiles_x);
        const std::set<std::uint32_t> listed(tiles.begin(), tiles.end());
        EXPECT_EQ(listed.size(), tiles.size()) << "splat " << i << " lists a tile twice";
        EXPECT_EQ(frame.intersection_count[i], tiles.size()) << "splat " << i;
        EXPECT_LT(*listed.rbegin(), truth.tiles.tile_count()) << "splat " << i;
        for (const std::uint32_t tile : tiles_with_pixels(s, kernel, camera, tiles_x)) {
            ++counts.tiles_with_pixels;
            EXPECT_TRUE(listed.contains(tile)) << "splat " << i << " misses tile " << tile;
        }
        for (const CoverCell& c : cover_cells(frame.cover[i])) {
            const auto px = [](std::uint32_t tile) { return static_cast<int>(tile * TILE_SIZE); };
            const double q =
                reference::smallest_q(s, px(c.x0), px(c.y0), std::min(px(c.x1), camera.width),
                                      std::min(px(c.y1), camera.height));
            EXPECT_LE(q, s.reach * 1.003 + 3e-3)
                << "splat " << i << " has no business in tile " << c.x0 << ", " << c.y0;
        }
    }
    return counts;
}

TEST(TileCover, small_splats_are_listed_tile_by_tile) {
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            SCOPED_TRACE(std::string(kernel_name(kernel)) + " " +
                         std::string(footprint_name(footprint)));
            const TestScene s = random_scene({.count = 60,
                                              .width = 150,
                                              .height = 110,
                                              .kernel = kernel,
                                              .footprint = footprint,
                                              .sh_degree = 0,
                                              .min_log_scale = -5,
                                              .max_log_scale = -2.5,
                                              .min_logit = -5,
                                              .max_logit = 6,
                                              .seed = 12});
            const CoverCounts counts = expect_cover_exact(s.model, s.camera);
            EXPECT_GT(counts.visible, 40U);
            EXPECT_GT(counts.tiles_with_pixels, 80U);
            // The slack of the test: a thousandth of the reach and of a unit of q.
            EXPECT_LE(counts.intersections,
                      counts.reference_intersections + 2 + counts.reference_intersections / 50);
        }
}

TEST(TileCover, large_splats_are_listed_in_cells) {
    TestScene s = random_scene({.count = 40,
                                .width = 500,
                                .height = 330,
                                .sh_degree = 0,
                                .min_log_scale = -2.5,
                                .max_log_scale = 0.5,
                                .min_logit = -3,
                                .seed = 13});
    const CoverCounts counts = expect_cover_exact(s.model, s.camera);
    EXPECT_GT(counts.visible, 30U);
    EXPECT_GT(counts.intersections, 5000U);
    // Cells of 2 x 2 to 4 x 4 tiles hold some that the ellipse misses.
    EXPECT_LE(counts.intersections, counts.reference_intersections * 115 / 100);
}

TEST(TileCover, needles_across_the_image_miss_most_tiles) {
    TestScene s = random_scene({.count = 40, .width = 300, .height = 300, .sh_degree = 0});
    for (size_t i = 0; i < s.model.size(); ++i)
        for (int c = 0; c < 3; ++c) s.model.log_scale[i * 3 + c] = c == 0 ? 1.0f : -9.0f;
    const CoverCounts counts = expect_cover_exact(s.model, s.camera);
    EXPECT_GT(counts.visible, 20U);
    EXPECT_LT(counts.intersections, counts.visible * 19 * 19 / 2);
}

TEST(TileCover, odd_image_sizes_end_at_their_last_pixel) {
    for (const auto& [width, height] : std::vector<std::pair<int, int>>{
             {1, 1}, {15, 16}, {16, 17}, {17, 5}, {33, 31}, {1, 700}, {900, 2}}) {
        SCOPED_TRACE(fmt::format("{} x {}", width, height));
        TestScene s = random_scene({.count = 80,
                                    .width = width,
                                    .height = height,
                                    .sh_degree = 0,
                                    .min_log_scale = -6,
                                    .max_log_scale = -1,
                                    .seed = 14});
        s.camera.fx = s.camera.fy = std::max(width, height);
        const CoverCounts counts = expect_cover_exact(s.model, s.camera);
        EXPECT_GT(counts.visible, 0U);
    }
}

TEST(TileCover, one_splat_over_everything_lists_every_tile) {
    TestScene s = random_scene({.count = 1, .width = 1000, .height = 700, .sh_degree = 0});
    for (int c = 0; c < 3; ++c) {
        s.model.position[c] = 0;
        s.model.log_scale[c] = 4;
    }
    s.model.opacity_logit[0] = 3;
    const ProjectedFrame frame = project_on_device(s.model, s.camera);
    EXPECT_EQ(frame.intersection_count[0], 63U * 44U);
    EXPECT_EQ(cover_tiles(frame.cover[0], 63).size(), 63U * 44U);
}

}  // namespace
}  // namespace darb::test
