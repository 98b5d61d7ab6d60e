// SPDX-License-Identifier: MIT
// Every way of the backward blend alone, blend_backward.comp and those with _team, _buckets and
// _pixels, against the reference: one gradient for each splat-tile intersection.
#include "engine/reference/reference_loss.h"
#include "tests/support/blend_scene.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/every_kernel.h"

namespace darb::test {
namespace {

using Intersections = std::vector<reference::ProjectedGradient<double>>;

/// By the chain rule of q = x^2 + y^2, x = l11 dx + l21 dy, y = l22 dy.
Intersections gradients_of(const BlendScene& scene, const reference::TileLists& lists,
                           const BlendOutput& out) {
    Intersections intersections;
    for (size_t k = 0; k < lists.intersection_count(); ++k) {
        const auto& s = scene.splats[lists.splats[k]];
        const IntersectionSums& p = out.intersections[k];
        const double d_l21 = 2.0 * p.gx_dy;
        intersections.push_back({{2 * s.l11 * p.gx, 2 * (s.l21 * p.gx + s.l22 * s.l22 * p.g_dy)},
                                 (2.0 * p.gxx - s.l21 * d_l21) / s.l11,  // x = l11 dx + l21 dy
                                 d_l21,
                                 2 * s.l22 * p.g_dy_dy,
                                 p.d_opacity,
                                 p.d_exponent,
                                 p.d_depth,
                                 glm::dvec3(p.d_colour)});
    }
    return intersections;
}

/// One quantity of every intersection in a row.
template <class Get>
std::vector<double> column(const Intersections& intersections, const Get& get) {
    std::vector<double> values;
    for (const auto& p : intersections) values.push_back(get(p));
    return values;
}

struct Result {
    reference::TileLists lists;
    Intersections truth, got;
    BlendOutput out;
};

void expect_gradients_match(const Result& r, const Tolerance& allowed, bool shaped) {
    const auto check = [&](const char* name, const auto& get) {
        const std::vector<double> expected = column(r.truth, get);
        EXPECT_TRUE(compare_scaled(name, expected, column(r.got, get), allowed));
    };
    check("d_mean.x", [](const auto& p) { return p.d_mean_px.x; });
    check("d_mean.y", [](const auto& p) { return p.d_mean_px.y; });
    check("d_l11", [](const auto& p) { return p.d_l11; });
    check("d_l21", [](const auto& p) { return p.d_l21; });
    check("d_l22", [](const auto& p) { return p.d_l22; });
    check("d_opacity", [](const auto& p) { return p.d_opacity; });
    check("d_depth", [](const auto& p) { return p.d_depth; });
    if (shaped) check("d_exponent", [](const auto& p) { return p.d_exponent; });
    for (int c = 0; c < 3; ++c)
        check(fmt::format("d_colour.{}", c).c_str(), [c](const auto& p) { return p.d_colour[c]; });
}

/// Adds a plane of random numbers, and returns it.
Image<double> add_random_plane(const BlendScene& scene, Pcg32& rng, std::vector<float>& planes) {
    Image<double> plane(scene.width, scene.height, 1);
    for (double& d : plane.data) {
        planes.push_back(static_cast<float>(rng.uniform(-1, 1)));
        d = planes.back();
    }
    return plane;
}

/// Adds the planes of squares and of z0, and turns the other two, which so far stand for sums of z
/// - z0, to gradients of sums of z.
void add_spread_planes(const BlendScene& scene, const reference::TileLists& lists, Pcg32& rng,
                       std::vector<float>& planes, Image<double>& d_alpha, Image<double>& d_depth) {
    const Image<double> d_square = add_random_plane(scene, rng, planes);
    const DepthPlanes picture(scene, blend_on_device(scene, lists).image);
    planes.insert(planes.end(), picture.first.begin(), picture.first.end());
    Image<double> both(scene.width, scene.height, 2);
    for (size_t p = 0; p < d_square.data.size(); ++p) {
        const double first = picture.first[p], by_square = d_square.data[p];
        d_alpha.data[p] += first * (first * by_square - d_depth.data[p]);
        both.data[2 * p] = d_depth.data[p] - 2 * first * by_square;
        both.data[2 * p + 1] = by_square;
    }
    d_depth = both;
}

/// Compares the way of going back that the scene names.
Result expect_backward_matches(const BlendScene& scene, const Tolerance& allowed) {
    const size_t pixels = size_t(scene.width) * scene.height;
    Pcg32 rng(23);
    Image<double> d_colour(scene.width, scene.height, 3);
    std::vector<float> planes(pixels * 3);
    for (size_t i = 0; i < pixels; ++i)
        for (size_t c = 0; c < 3; ++c) {
            planes[c * pixels + i] = static_cast<float>(rng.uniform(-1, 1));
            d_colour.data[i * 3 + c] = planes[c * pixels + i];
        }
    Image<double> d_alpha, d_depth;
    for (Image<double>* plane : {&d_alpha, &d_depth})
        if (scene.depth_sum) *plane = add_random_plane(scene, rng, planes);
    Result r{scene.lists(), {}, {}, {}};
    if (scene.depth_spread) add_spread_planes(scene, r.lists, rng, planes, d_alpha, d_depth);
    r.truth.resize(r.lists.intersection_count());
    for (size_t t = 0; t < r.lists.tile_count(); ++t)
        reference::blend_tile_backward(r.lists, t, scene.splats, scene.table(), scene.settings(),
                                       {d_colour, d_alpha, d_depth},
                                       r.truth.data() + r.lists.begin[t]);
    r.out = blend_on_device(scene, r.lists, true, planes);
    r.got = gradients_of(scene, r.lists, r.out);
    expect_gradients_match(r, allowed, kernel_has_shape(scene.kernel));
    return r;
}

// Layers of 0.985: the third would cross the stop; and clamped ones, without a gradient of alpha.
void add_opaque_layers(BlendScene& scene) {
    for (int i = 0; i < 12; ++i)
        scene.add({4.0 + 3 * (i % 4), 8.2 - i % 3}, {9, 1, 7}, i % 2 ? 1 : 0.985,
                  {i % 2 * 1.0, 1 - i % 2, 0.5});
}

// The mean on a pixel centre: dq = 0 and every gradient of the shape vanishes, none is NaN.
void add_centred_layers(BlendScene& scene) {
    scene.add({5.5, 7.5}, {0.3, 0, 0.3}, 0.7, {1, 0.5, 0});
    scene.add({5.5, 7.5}, {4, 0.3, 6}, 0.7, {0, 0.5, 1});
}

class BlendBackward : public testing::TestWithParam<BlendVariant> {
  protected:
    const Tolerance& allowed() const {
        return tolerance(GetParam().steep_edge() ? "gradient_steep_float32"
                                                 : "gradient_scaled_float32");
    }
};

class EveryWay : public testing::TestWithParam<BackwardBlend> {
  protected:
    BlendScene empty_scene(int width = 16, int height = 16) const {
        BlendScene s = BlendVariant{KERNEL_RAISED_COSINE}.scene(width, height);
        s.back = GetParam();
        return s;
    }
};

TEST_P(BlendBackward, random_layers_match_double) {
    BlendScene scene = GetParam().scene(53, 37);
    scene.add_random(120, 4, 0.01, 0.98);
    const Result r = expect_backward_matches(scene, allowed());
    EXPECT_GT(r.lists.intersection_count(), 200U);
}

TEST_P(EveryWay, exponents_of_splats_match_double) {
    for (const int kernel : every_shaped_kernel()) {
        SCOPED_TRACE(kernel_name(kernel));
        BlendScene scene = BlendVariant{kernel}.scene(53, 37);
        scene.back = GetParam();
        scene.add_random(120, 8, 0.01, 0.98);
        // On a pixel's centre: a kink at the edge, or the steepest centre.
        scene.add({5.5, 7.5}, {0.3, 0, 0.3}, 0.7, {1, 0.5, 0},
                  shaped_kernel(kernel).exponent_least());
        const Result r = expect_backward_matches(scene, tolerance("gradient_scaled_float32"));
        EXPECT_GT(r.lists.intersection_count(), 200U);
    }
}

TEST_P(EveryWay, gradients_of_summed_depths_match_double) {
    for (const std::uint32_t segment : {0u, 128u}) {
        SCOPED_TRACE(segment);
        BlendScene scene = empty_scene(53, 37);
        scene.depth_sum = true;
        scene.segment = segment;
        scene.add_random(900, 4, 0.01, 0.9);
        for (auto& s : scene.splats) s.depth = 1 + s.depth / 256;
        const Result r = expect_backward_matches(scene, tolerance("gradient_scaled_float32"));
        EXPECT_NE(r.out.intersections[0].d_depth, 0);
        // The picture has them, too, and the colours are those without.
        const reference::BlendImages<double> images = blend_in_double(scene, r.lists);
        const auto at = r.out.image.begin() + std::ptrdiff_t{3} * 53 * 37;
        EXPECT_TRUE(compare("sum w z", images.depth.data, std::vector<float>(at, r.out.image.end()),
                            tolerance("image_float32")));
        scene.depth_sum = false;
        const BlendOutput without = blend_on_device(scene, r.lists);
        EXPECT_TRUE(std::equal(without.image.begin(), without.image.end(), r.out.image.begin()));
    }
}

// In parts, between which the picture holds the sums; in one piece below.
TEST_P(EveryWay, gradients_of_squared_depths_match_double) {
    BlendScene scene = empty_scene(53, 37);
    scene.depth_sum = scene.depth_spread = true;
    scene.segment = 128;
    scene.add_random(900, 4, 0.01, 0.9);
    for (auto& s : scene.splats) s.depth = 1 + s.depth / 256;
    const Result r = expect_backward_matches(scene, tolerance("gradient_scaled_float32"));
    EXPECT_NE(r.out.intersections[0].d_depth, 0);
    scene.depth_sum = scene.depth_spread = false;
    const BlendOutput without = blend_on_device(scene, r.lists);
    EXPECT_TRUE(std::equal(without.image.begin(), without.image.end(), r.out.image.begin()));
}

// The distortion of depths 0.01 apart at a distance of 1,000, where float has steps of 6e-5.
TEST_P(EveryWay, gradients_of_the_spread_of_depths_far_away_match_double) {
    BlendScene scene = empty_scene(53, 37);
    scene.depth_sum = scene.depth_spread = true;
    scene.add_random(400, 4, 0.01, 0.9);
    for (size_t i = 0; i < scene.splats.size(); ++i)
        scene.splats[i].depth = static_cast<float>(1000 + 0.01 * double(i % 97) / 97.0);
    Result r{scene.lists(), {}, {}, {}};
    const size_t pixels = size_t(scene.width) * scene.height;
    const BlendOutput picture = blend_on_device(scene, r.lists);
    const DepthPlanes depths(scene, picture.image);
    const auto exact =
        reference::distortion(blend_in_double(scene, r.lists), double(pixels) * 1e6 * 1e4);
    std::vector<float> planes(7 * pixels, 0.0f);
    for (size_t p = 0; p < pixels; ++p) {  // as depth_loss.comp has them
        const float cover = 1 - picture.transmittance[p], sum = depths.sum[p];
        const float depth = depths.first[p] + sum / std::max(cover, 1e-9f);
        const float share = 8e12f / (depth * depth);  // 2e10 over the square of the width
        planes[3 * pixels + p] = share * depths.square[p];
        planes[4 * pixels + p] = -2 * share * sum;
        planes[5 * pixels + p] = share * cover;
        planes[6 * pixels + p] = depths.first[p];
    }
    r.truth.resize(r.lists.intersection_count());
    for (size_t t = 0; t < r.lists.tile_count(); ++t)
        reference::blend_tile_backward(
            r.lists, t, scene.splats, scene.table(), scene.settings(),
            {Image<double>(scene.width, scene.height, 3), exact.d_alpha, exact.d_depth},
            r.truth.data() + r.lists.begin[t]);
    r.out = blend_on_device(scene, r.lists, true, planes);
    r.got = gradients_of(scene, r.lists, r.out);
    expect_gradients_match(r, tolerance("gradient_scaled_float32"), false);
    EXPECT_NE(r.out.intersections[0].d_depth, 0);
}

// The kernels' own code is that of the other way, so that one case of each is enough.
class ByBuckets : public BlendBackward {};

TEST_P(ByBuckets, random_layers_match_double) {
    BlendScene scene = GetParam().scene(53, 37);
    scene.back = BackwardBlend::buckets;
    scene.add_random(120, 4, 0.01, 0.98);
    const Result r = expect_backward_matches(scene, allowed());
    EXPECT_GT(r.lists.intersection_count(), 200U);
}

TEST_P(BlendBackward, opaque_layers_match_double_through_clamp_and_stop) {
    BlendScene scene = GetParam().scene();
    add_opaque_layers(scene);
    expect_backward_matches(scene, allowed());
}

TEST_P(BlendBackward, mean_on_a_pixel_centre_gives_finite_gradients) {
    BlendScene scene = GetParam().scene();
    add_centred_layers(scene);
    expect_backward_matches(scene, allowed());
}

INSTANTIATE_TEST_SUITE_P(every_kernel, BlendBackward, testing::ValuesIn(every_backward_variant()),
                         [](const auto& v) { return v.param.name(); });

std::vector<BlendVariant> every_polynomial() {
    std::vector<BlendVariant> all = every_blend_variant();
    std::erase_if(all, [](const BlendVariant& v) { return v.evaluation == EVALUATION_BUILTIN; });
    return all;
}

INSTANTIATE_TEST_SUITE_P(every_kernel, ByBuckets, testing::ValuesIn(every_polynomial()),
                         [](const auto& v) { return v.param.name(); });

INSTANTIATE_TEST_SUITE_P(BlendBackwardCases, EveryWay,
                         testing::Values(BackwardBlend::subgroup, BackwardBlend::team,
                                         BackwardBlend::buckets, BackwardBlend::pixels,
                                         BackwardBlend::pixels4),
                         [](const auto& v) {
                             return kBackwardBlends[static_cast<size_t>(v.param)];
                         });

TEST_P(EveryWay, opaque_layers_match_double_through_clamp_and_stop) {
    BlendScene scene = empty_scene();
    add_opaque_layers(scene);
    expect_backward_matches(scene, tolerance("gradient_scaled_float32"));
}

TEST_P(EveryWay, mean_on_a_pixel_centre_gives_finite_gradients) {
    BlendScene scene = empty_scene();
    add_centred_layers(scene);
    expect_backward_matches(scene, tolerance("gradient_scaled_float32"));
}

TEST_P(EveryWay, ten_thousand_thin_layers_match_double) {
    BlendScene scene = empty_scene();
    scene.cutoff = 1e-6f;
    for (int i = 0; i < 10'000; ++i)
        scene.add({8.5, 8.5}, {400, 0, 400}, 3e-4, {i % 7 / 7.0, i % 3 / 3.0, 0.5});
    expect_backward_matches(scene, tolerance("gradient_thin_layers"));
}

TEST_P(EveryWay, odd_image_sizes_match_double) {
    for (const auto& [width, height] :
         std::vector<std::pair<int, int>>{{1, 1}, {17, 5}, {1, 300}, {300, 1}, {31, 33}}) {
        SCOPED_TRACE(fmt::format("{} x {}", width, height));
        BlendScene scene = empty_scene(width, height);
        scene.add_random(100, 6, 0.1, 0.9);
        const Result r = expect_backward_matches(scene, tolerance("gradient_scaled_float32"));
        EXPECT_GT(r.lists.intersection_count(), 5U);
    }
}

TEST_P(EveryWay, intersections_behind_the_stop_get_zero) {
    BlendScene scene = empty_scene();
    for (int i = 0; i < 100; ++i) scene.add({8.5, 8.5}, {400, 0, 400}, 0.97, {1, 0.5, 0.2});
    const Result r = expect_backward_matches(scene, tolerance("gradient_scaled_float32"));
    for (size_t k = 5; k < 100; ++k) {
        const IntersectionSums& p = r.out.intersections[k];
        EXPECT_EQ(glm::vec4(p.gx, p.gxx, p.gx_dy, p.g_dy), glm::vec4(0)) << "intersection " << k;
        EXPECT_EQ(glm::vec4(p.d_colour, p.g_dy_dy), glm::vec4(0)) << "intersection " << k;
        EXPECT_EQ(p.d_opacity, 0) << "intersection " << k;
    }
}

TEST_P(EveryWay, alpha_at_its_limit_moves_only_the_colour) {
    BlendScene scene = empty_scene();
    scene.add({8, 8}, {1e6, 0, 1e6}, 0.9999, {1, 0.5, 0.2});  // above 0.99 in every pixel
    const Result r = expect_backward_matches(scene, tolerance("gradient_scaled_float32"));
    const IntersectionSums& p = r.out.intersections[0];
    EXPECT_EQ(glm::vec4(p.gx, p.gxx, p.gx_dy, p.g_dy), glm::vec4(0));
    EXPECT_EQ(p.g_dy_dy, 0);
    EXPECT_EQ(p.d_opacity, 0);
    EXPECT_NE(p.d_colour, glm::vec3(0));
}

TEST_P(EveryWay, the_second_of_two_clamped_layers_gets_its_gradient) {
    BlendScene scene = empty_scene();
    for (int i = 0; i < 3; ++i) scene.add({8, 8}, {1e6, 0, 1e6}, 0.9999, {1, 0.5, 0.2});
    const Result r = expect_backward_matches(scene, tolerance("gradient_scaled_float32"));
    EXPECT_NE(r.out.intersections[1].d_colour, glm::vec3(0));
    EXPECT_EQ(r.out.intersections[2].d_colour, glm::vec3(0));
}

bool same_bits(const BlendOutput& a, const BlendOutput& b) {
    return a.intersections.size() == b.intersections.size() && a.image == b.image &&
           std::memcmp(a.intersections.data(), b.intersections.data(),
                       a.intersections.size() * sizeof(IntersectionSums)) == 0;
}

TEST(BlendBackwardTeam, gives_the_sums_of_one_subgroup) {
    BlendScene scene = BlendVariant{KERNEL_RAISED_COSINE}.scene(53, 37);
    scene.add_random(700, 4, 0.01, 1);
    const std::vector<float> d_image(53 * 37 * 3, 0.3f);
    const reference::TileLists lists = scene.lists();
    const BlendOutput one = blend_on_device(scene, lists, true, d_image);
    scene.back = BackwardBlend::team;
    const BlendOutput team = blend_on_device(scene, lists, true, d_image);
    // As numbers: a sum of nothing may be -0 on one side.
    for (size_t k = 0; k < lists.intersection_count(); ++k)
        for (int i = 0; i < 9; ++i)
            ASSERT_EQ((&one.intersections[k].gx)[i], (&team.intersections[k].gx)[i]) << k;
}

TEST_P(EveryWay, a_second_run_gives_the_same_bits) {
    BlendScene scene = empty_scene(53, 37);
    scene.add_random(150, 4, 0.01, 1);
    const std::vector<float> d_image(53 * 37 * 3, 0.3f);
    const reference::TileLists lists = scene.lists();
    const BlendOutput one = blend_on_device(scene, lists, true, d_image);
    EXPECT_TRUE(same_bits(one, blend_on_device(scene, lists, true, d_image)));
    EXPECT_NE(one.intersections[0].d_colour, glm::vec3(0));
}

TEST_P(EveryWay, skipping_blocks_that_are_not_touched_changes_no_bit) {
    BlendScene scene = empty_scene(53, 37);
    scene.add_random(150, 4, 0.01, 1);
    const std::vector<float> d_image(53 * 37 * 3, 0.3f);
    const reference::TileLists lists = scene.lists();
    EXPECT_TRUE(same_bits(blend_on_device(scene, lists, true, d_image),
                          blend_on_device(scene, lists, true, d_image, true)));
}

TEST_P(EveryWay, lists_worked_off_in_parts_change_no_bit) {
    BlendScene scene = empty_scene(53, 37);
    scene.add_random(2000, 4, 0.01, 0.3);
    const std::vector<float> d_image(53 * 37 * 3, 0.3f);
    const reference::TileLists lists = scene.lists();
    const BlendOutput whole = blend_on_device(scene, lists, true, d_image);
    scene.segment = 128;
    EXPECT_TRUE(same_bits(blend_on_device(scene, lists, true, d_image), whole));
}

// Mesa 22.3 would cut a dispatch after 12,800 splats, 10,700 at four lanes: see blend_test.
TEST_P(EveryWay, twenty_five_thousand_layers_match_double) {
    BlendScene scene = empty_scene();
    scene.cutoff = 1e-6f;
    scene.segment = LIST_SEGMENT;
    for (int i = 0; i < 25'000; ++i)
        scene.add({8.5, 8.5}, {400, 0, 400}, 1e-4, {i % 7 / 7.0, i % 3 / 3.0, 0.5});
    expect_backward_matches(scene, tolerance("gradient_thin_layers_walk"));
}

}  // namespace
}  // namespace darb::test
