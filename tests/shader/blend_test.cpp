// SPDX-License-Identifier: MIT
// blend.comp and blend_records.comp alone against the blending of the reference, on splats set by
// hand.
#include <algorithm>

#include "engine/plan/tuner.h"
#include "tests/support/blend_scene.h"
#include "tests/support/compare_arrays.h"

namespace darb::test {
namespace {

struct Blended {
    reference::TileLists lists;
    reference::BlendImages<double> truth;
    BlendOutput got;

    double pixel(int x, int y, int c) const {
        const Image<double>& image = truth.colour;
        return got.image[(size_t(c) * image.height + y) * image.width + x];
    }
};

/// Blends on both sides and compares colours and transmittance.
Blended expect_blend_matches(const BlendScene& scene, const char* allowed = "image_float32") {
    Blended b{scene.lists(), {}, {}};
    b.truth = blend_in_double(scene, b.lists);
    b.got = blend_on_device(scene, b.lists);
    std::vector<double> expected;
    for (int c = 0; c < 3; ++c)
        for (int y = 0; y < scene.height; ++y)
            for (int x = 0; x < scene.width; ++x) expected.push_back(b.truth.colour.at(x, y, c));
    EXPECT_TRUE(compare("image", expected, b.got.image, tolerance(allowed), scene.width));
    EXPECT_TRUE(compare("transmittance", b.truth.transmittance.data, b.got.transmittance,
                        tolerance(allowed), scene.width));
    return b;
}

class Blend : public testing::TestWithParam<BlendVariant> {};

TEST_P(Blend, random_layers_match_double) {
    BlendScene scene = GetParam().scene(53, 37);
    scene.add_random(150, 4, 0.01, 1);
    const Blended b = expect_blend_matches(scene);
    EXPECT_GT(b.lists.intersection_count(), 300U);
}

TEST_P(Blend, mean_on_a_pixel_centre_shows_the_full_opacity) {
    BlendScene scene = GetParam().scene();
    scene.add({5.5, 7.5}, {2, 0.3, 1}, 0.75, {1, 0.5, 0});
    const Blended b = expect_blend_matches(scene, "image_exact_kernel");
    const float expected = 0.75f + 0.25f * 0.1f;
    EXPECT_NEAR(b.pixel(5, 7, 0), expected, 3e-7);
}

// Pixels at both sides of the edge, at 1e-5 and 1e-3 of the support, where the support has an edge.
TEST_P(Blend, pixels_at_the_edge_of_the_support_match_double) {
    const double support = kernel_support(GetParam().kernel);
    if (!std::isfinite(support)) return;
    for (const double off : {-1e-3, -1e-5, 1e-5, 1e-3}) {
        SCOPED_TRACE(off);
        BlendScene scene = GetParam().scene();
        const double sigma = 5 / std::sqrt(support * (1 + off));  // 5 px away on every side
        scene.add({8.5, 8.5}, {sigma * sigma, 0, sigma * sigma}, 0.9, {1, 1, 1});
        const Blended b = expect_blend_matches(scene, "image_exact_kernel");
        EXPECT_EQ(b.truth.contributions.at(14, 8, 0), 0);
        EXPECT_GT(b.truth.contributions.at(12, 8, 0), 0);
        const double w = kernel_value(GetParam().kernel, GetParam().footprint, support * (1 + off));
        EXPECT_EQ(b.truth.contributions.at(13, 8, 0), 0.9 * w >= ALPHA_CUTOFF_DEFAULT ? 1 : 0);
    }
}

TEST_P(Blend, opaque_stack_stops_before_the_transmittance_limit) {
    BlendScene scene = GetParam().scene();
    for (int i = 0; i < 40; ++i)
        scene.add({8.5 + i / 2 % 3, 8.5}, {200, 0, 200}, 1, {i % 2 * 1.0, 1 - i % 2, 0.5});
    const Blended b = expect_blend_matches(scene);
    for (const double t : b.truth.transmittance.data) ASSERT_LT(t, 0.02);
    // Each clamped layer lets 0.01 through: two of them meet the stop exactly, and do not cross it.
    EXPECT_NEAR(b.pixel(8, 8, 0), 0.01 * 0.99 + 1e-4 * 0.1, 2e-8);
    EXPECT_NEAR(b.got.transmittance[8 * 16 + 8], 1e-4, 1e-9);
    EXPECT_EQ(b.got.last[8 * 16 + 8], 2U);
}

TEST_P(Blend, clamped_layers_down_to_any_stop_are_shown) {
    for (int layers = 1; layers <= 3; ++layers) {
        SCOPED_TRACE(layers);
        BlendScene scene = GetParam().scene();
        scene.stop = std::array{1e-2f, 1e-4f, 1e-6f}[static_cast<size_t>(layers - 1)];
        for (int i = 0; i < 5; ++i) scene.add({8.5, 8.5}, {200, 0, 200}, 1, {0.5, i % 2 * 1.0, 1});
        const Blended b = expect_blend_matches(scene);
        EXPECT_EQ(b.truth.contributions.at(8, 8, 0), layers);
        EXPECT_EQ(b.got.last[8 * 16 + 8], static_cast<std::uint32_t>(layers));
    }
}

INSTANTIATE_TEST_SUITE_P(every_kernel, Blend, testing::ValuesIn(every_forward_variant()),
                         [](const auto& v) { return v.param.name(); });

const BlendVariant kCosine{KERNEL_RAISED_COSINE, Footprint::psi, EVALUATION_POLYNOMIAL};

TEST(BlendCases, ten_thousand_thin_layers_match_double) {
    for (const bool records : {false, true}) {
        SCOPED_TRACE(records);
        BlendScene scene = kCosine.scene();
        scene.records = records;
        scene.cutoff = 1e-6f;  // else the transmittance stop ends a pixel after 2,300 layers
        for (int i = 0; i < 10'000; ++i)
            scene.add({8.5, 8.5}, {400, 0, 400}, 3e-4, {i % 7 / 7.0, i % 3 / 3.0, 0.5});
        const Blended b = expect_blend_matches(scene, "image_thin_layers");
        EXPECT_EQ(b.truth.contributions.at(8, 8, 0), 10'000);
        EXPECT_EQ(b.got.last[8 * 16 + 8], 10'000U);
    }
}

TEST(BlendCases, no_splats_leave_the_background) {
    const Blended b = expect_blend_matches(kCosine.scene(40, 20), "exact");
    for (const std::uint32_t last : b.got.last) EXPECT_EQ(last, 0U);
    EXPECT_EQ(b.pixel(39, 19, 2), 0.9f);
}

TEST(BlendCases, image_sizes_that_are_no_multiple_of_a_tile_match_double) {
    for (const auto& [width, height] :
         std::vector<std::pair<int, int>>{{1, 1}, {17, 5}, {1, 4096}, {4096, 1}, {31, 33}}) {
        SCOPED_TRACE(fmt::format("{} x {}", width, height));
        BlendScene scene = kCosine.scene(width, height);
        scene.add_random(200, 6, 0.1, 0.9);
        const Blended b = expect_blend_matches(scene);
        EXPECT_GT(b.lists.intersection_count(), 20U);
    }
}

TEST(BlendCases, storing_for_the_backward_pass_changes_no_bit) {
    BlendScene scene = kCosine.scene(53, 37);
    scene.add_random(150, 4, 0.01, 1);
    const reference::TileLists lists = scene.lists();
    EXPECT_EQ(blend_on_device(scene, lists, true).image,
              blend_on_device(scene, lists, false).image);
}

double largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
    if (a.size() != b.size()) return HUGE_VAL;
    double most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(double(a[i]) - b[i]));
    return most;
}

// The place where a pixel ended may differ by intersections that miss its block, some of which a
// larger area includes; and q is rounded differently, as a thread computes it from its first pixel.
TEST(BlendCases, every_shape_of_workgroup_gives_the_same_picture) {
    BlendScene scene = kCosine.scene(53, 37);
    scene.add_random(150, 4, 0.01, 1);
    const reference::TileLists lists = scene.lists();
    const BlendOutput usual = blend_on_device(scene, lists);
    const std::vector<TuningGroup> groups = tuning_groups(shared_device().info());
    const auto shapes = std::ranges::find(groups, "blend", &TuningGroup::name);
    ASSERT_NE(shapes, groups.end());
    EXPECT_GE(shapes->choices.size(), 3U);
    for (const std::string& shape : shapes->choices) {
        SCOPED_TRACE(shape);
        scene.records = shape == "records";
        scene.threads = scene.records ? 0 : static_cast<std::uint32_t>(std::stoul(shape));
        const BlendOutput out = blend_on_device(scene, lists);
        EXPECT_LE(largest_difference(out.image, usual.image), 2e-6);
        EXPECT_LE(largest_difference(out.transmittance, usual.transmittance), 2e-6);
    }
}

// Before a block's first end nothing is tested; the batch with that end is blended a second time.
TEST(BlendCases, records_end_every_pixel_where_the_other_form_does) {
    for (const double opacity : {0.3, 0.9, 0.999}) {
        SCOPED_TRACE(opacity);
        BlendScene scene = kCosine.scene(53, 37);
        scene.add_random(1200, 9, 0.01, opacity);
        const reference::TileLists lists = scene.lists();
        const BlendOutput usual = blend_on_device(scene, lists);
        scene.records = true;
        const BlendOutput out = blend_on_device(scene, lists);
        EXPECT_EQ(out.last, usual.last);
        EXPECT_LE(largest_difference(out.image, usual.image), 2e-6);
        EXPECT_LE(largest_difference(out.transmittance, usual.transmittance), 2e-6);
        const auto [first, last] = std::minmax_element(out.last.begin(), out.last.end());
        if (opacity > 0.9) {
            EXPECT_LT(*first, *last) << "no pixel ends before another";
        }
    }
}

TEST(BlendCases, records_keep_the_sum_of_depths) {
    BlendScene scene = kCosine.scene(53, 37);
    scene.records = scene.depth_sum = true;
    scene.add_random(900, 4, 0.01, 0.9);
    for (auto& s : scene.splats) s.depth = 1 + s.depth / 256;
    const reference::TileLists lists = scene.lists();
    const reference::BlendImages<double> truth = blend_in_double(scene, lists);
    const std::vector<float> image = blend_on_device(scene, lists).image;
    EXPECT_TRUE(
        compare("sum w z", truth.depth.data,
                std::vector<float>(image.begin() + std::ptrdiff_t{3} * 53 * 37, image.end()),
                tolerance("image_float32")));
}

// Depths 0.01 apart at a distance of 1,000: the difference of the sums themselves would be a
// hundred times smaller than their rounding. In front of some a splat that is hardly there.
TEST(BlendCases, spreads_of_depths_far_away_keep_their_digits) {
    for (const bool records : {false, true})
        for (const bool floater : {false, true}) {
            SCOPED_TRACE(fmt::format("records {}, floater {}", records, floater));
            BlendScene scene = kCosine.scene(53, 37);
            scene.records = records;
            scene.depth_sum = scene.depth_spread = true;
            if (floater) scene.add({26, 18}, {4e4, 0, 4e4}, 0.0045, {1, 1, 1});
            scene.add_random(900, 4, 0.01, 0.9);
            for (size_t i = 0; i < scene.splats.size(); ++i)
                scene.splats[i].depth =
                    floater && i == 0 ? 1 : static_cast<float>(1000 + 0.01 * double(i % 97) / 97.0);
            const reference::TileLists lists = scene.lists();
            const BlendOutput out = blend_on_device(scene, lists);
            // Counted from 1,000, as double would lose digits, too; the spread is the same.
            for (auto& s : scene.splats) s.depth -= 1000;
            const reference::BlendImages<double> truth = blend_in_double(scene, lists);
            const DepthPlanes planes(scene, out.image);
            double largest = 0;
            for (size_t p = 0; p < truth.depth.data.size(); ++p) {
                const double cover = 1 - truth.transmittance.data[p];
                const double exact =
                    cover * truth.square.data[p] - std::pow(truth.depth.data[p], 2);
                largest = std::max(largest, exact);
                EXPECT_NEAR(planes.spread(p, 1 - double(out.transmittance[p])), exact,
                            1e-3 * exact + 1e-12)
                    << p;
            }
            EXPECT_GT(largest, floater ? 1e3 : 1e-6);
        }
}

TEST(BlendCases, a_second_run_by_records_gives_the_same_bits) {
    BlendScene scene = kCosine.scene(53, 37);
    scene.records = true;
    scene.add_random(700, 4, 0.01, 1);
    const reference::TileLists lists = scene.lists();
    const BlendOutput one = blend_on_device(scene, lists), two = blend_on_device(scene, lists);
    EXPECT_EQ(one.image, two.image);
    EXPECT_EQ(one.transmittance, two.transmittance);
    EXPECT_EQ(one.last, two.last);
}

TEST(BlendCases, checkpoints_change_no_bit) {
    BlendScene scene = kCosine.scene(53, 37);
    scene.add_random(150, 4, 0.01, 1);
    const reference::TileLists lists = scene.lists();
    const BlendOutput usual = blend_on_device(scene, lists);
    scene.back = BackwardBlend::buckets;
    const BlendOutput out = blend_on_device(scene, lists);
    EXPECT_EQ(out.image, usual.image);
    EXPECT_EQ(out.transmittance, usual.transmittance);
    EXPECT_EQ(out.last, usual.last);
}

TEST(BlendCases, a_list_that_shows_nothing_changes_no_bit) {
    BlendScene scene = kCosine.scene(53, 37);
    scene.add_random(150, 4, 0.01, 1);
    const std::vector<float> before = blend_on_device(scene, scene.lists()).image;
    // In front of the others: between pixels and too small, and off the image.
    BlendScene more = kCosine.scene(53, 37);
    for (int i = 0; i < 50; ++i) {
        more.add({i + 1.0, 9}, {0.02, 0, 0.02}, 0.9, {1, 1, 1});
        more.add({-40.0, i}, {9, 0, 9}, 0.9, {1, 1, 1});
    }
    more.splats.insert(more.splats.end(), scene.splats.begin(), scene.splats.end());
    reference::TileLists lists = scene.lists();
    for (std::uint32_t& splat : lists.splats) splat += 100;
    reference::TileLists longer = lists;
    longer.splats.clear();
    for (size_t t = 0; t < lists.tile_count(); ++t) {
        longer.begin[t] = static_cast<std::uint32_t>(longer.splats.size());
        for (std::uint32_t i = 0; i < 100; ++i) longer.splats.push_back(i);
        longer.splats.insert(longer.splats.end(), lists.splats.begin() + lists.begin[t],
                             lists.splats.begin() + lists.begin[t + 1]);
    }
    longer.begin.back() = static_cast<std::uint32_t>(longer.splats.size());
    EXPECT_EQ(blend_on_device(more, longer).image, before);
}

TEST(BlendCases, lists_worked_off_in_parts_change_no_bit) {
    for (const auto& [store, records] : {std::pair{true, false}, {false, false}, {true, true}}) {
        BlendScene scene = kCosine.scene(53, 37);
        scene.records = records;
        scene.add_random(2000, 4, 0.01, 0.3);
        const reference::TileLists lists = scene.lists();
        const std::vector<float> whole = blend_on_device(scene, lists, store).image;
        scene.segment = 128;
        EXPECT_EQ(blend_on_device(scene, lists, store).image, whole);
    }
}

// Mesa 22.3 ends every loop of a subgroup once all of them together made 65,535 rounds, after about
// 51,000 splats that touch its block, 42,000 at four lanes: no dispatch takes as many.
TEST(BlendCases, a_list_of_120000_splats_is_not_cut) {
    BlendScene scene = kCosine.scene();
    scene.cutoff = 1e-7f;
    scene.segment = LIST_SEGMENT;
    scene.add({8.5, 8.5}, {400, 0, 400}, 1e-5, {1, 0.5, 0.25});
    scene.add({8.5, 8.5}, {4, 0, 4}, 0.5, {1, 0, 0});
    reference::TileLists lists;
    lists.tiles_x = lists.tiles_y = 1;
    lists.splats.assign(120'000, 0);
    lists.splats.back() = 1;
    lists.begin = {0, 120'000};
    const BlendOutput got = blend_on_device(scene, lists);
    const reference::BlendImages<double> truth = blend_in_double(scene, lists);
    EXPECT_EQ(got.last[8 * 16 + 8], 120'000U);
    EXPECT_NEAR(got.image[8 * 16 + 8], truth.colour.at(8, 8, 0), 3e-3);
}

}  // namespace
}  // namespace darb::test
