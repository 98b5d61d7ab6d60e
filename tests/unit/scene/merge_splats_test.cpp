// SPDX-License-Identifier: MIT
#include "engine/scene/merge_splats.h"

#include <algorithm>
#include <limits>

#include "engine/kernels/kernel_profile.h"
#include "engine/scene/edit_splats.h"
#include "shaders/shared/limits.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

/// The whole scene as one splat: mass, mean and covariance, computed in one sum rather than by
/// pairs.
struct Whole {
    double mass = 0;
    glm::dvec3 mean{0.0}, dc{0.0};
    glm::dmat3 covariance{0.0};
};

glm::dmat3 covariance_of(const SplatModel& model, std::size_t i) {
    const float* r = &model.rotation[4 * i];
    const glm::dmat3 turn = rotation_of(r[0], r[1], r[2], r[3]);
    glm::dmat3 variance(0.0);
    for (int k = 0; k < 3; ++k)
        variance[k][k] = std::exp(2.0 * model.log_scale[3 * i + static_cast<std::size_t>(k)]);
    return turn * variance * glm::transpose(turn);
}

double norm(const glm::dvec3& v) {
    return glm::length(v);
}
double norm(const glm::dmat3& m) {
    return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
}

/// Opacity times the root mean square of the projected area, by a formula in the semi-axes.
double mass_of(const SplatModel& model, std::size_t i) {
    double v[3];
    for (std::size_t k = 0; k < 3; ++k) v[k] = std::exp(2.0 * model.log_scale[3 * i + k]);
    return sigmoid(model.opacity_logit[i]) *
           std::sqrt((v[0] * v[1] + v[1] * v[2] + v[2] * v[0]) / 3);
}

glm::dvec3 three(const std::vector<float>& values, std::size_t i) {
    return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

Whole whole_of(const SplatModel& model) {
    const double second_moment = rendered_second_moment(model.kernel, model.footprint);
    Whole whole;
    for (std::size_t i = 0; i < model.size(); ++i) {
        const double mass = mass_of(model, i);
        whole.mass += mass;
        whole.mean += mass * three(model.position, i);
        whole.dc += mass * three(model.sh_dc, i);
    }
    whole.mean /= whole.mass;
    whole.dc /= whole.mass;
    for (std::size_t i = 0; i < model.size(); ++i) {
        const glm::dvec3 d = three(model.position, i) - whole.mean;
        whole.covariance += mass_of(model, i) / whole.mass *
                            (covariance_of(model, i) + glm::outerProduct(d, d) / second_moment);
    }
    return whole;
}

/// Translucent splats, so that no merge exceeds an opacity of 1.
SplatModel translucent(std::size_t count, int degree = 1, std::uint64_t seed = 1) {
    SplatModel model = sample_model(degree, count, seed);
    for (float& logit : model.opacity_logit) logit = std::min(logit, 0.f) - 6;
    return model;
}

bool all_finite_and_drawn(const SplatModel& model) {
    for (std::size_t i = 0; i < model.size(); ++i)
        if (!has_rotation(model, i)) return false;
    return has_only_finite(model);
}

TEST(MergeSplats, two_become_the_one_of_their_moments) {
    for (const int kernel : {KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE, KERNEL_INVERSE_QUADRATIC})
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            SplatModel two = translucent(2, 3, 7);
            two.kernel = kernel;
            two.footprint = footprint;
            const Whole want = whole_of(two);
            const SplatModel one = merge_splats(two, 1);
            ASSERT_EQ(one.size(), 1u);
            const Whole got = whole_of(one);
            EXPECT_NEAR(got.mass, want.mass, 1e-5 * want.mass) << kernel_name(kernel);
            EXPECT_LT(norm(got.mean - want.mean), 1e-5 * norm(want.mean));
            EXPECT_LT(norm(got.dc - want.dc), 1e-5);
            EXPECT_LT(norm(got.covariance - want.covariance), 1e-5 * norm(want.covariance))
                << kernel_name(kernel) << " " << footprint_name(footprint);
            const double share = mass_of(two, 1) / (mass_of(two, 0) + mass_of(two, 1));
            const auto rest = static_cast<std::size_t>(two.rest_count());
            for (std::size_t c = 0; c < rest; ++c)
                EXPECT_NEAR(one.sh_rest[c],
                            (1 - share) * two.sh_rest[c] + share * two.sh_rest[rest + c], 1e-6);
        }
}

TEST(MergeSplats, the_whole_scene_keeps_its_moments) {
    const SplatModel scene = translucent(500);
    const Whole want = whole_of(scene);
    for (const std::size_t count : {400u, 100u, 7u, 1u}) {
        const Whole got = whole_of(merge_splats(scene, count));
        EXPECT_NEAR(got.mass, want.mass, 1e-5 * want.mass) << count;
        EXPECT_LT(norm(got.mean - want.mean), 1e-5 * std::sqrt(norm(want.covariance)));
        EXPECT_LT(norm(got.covariance - want.covariance), 1e-5 * norm(want.covariance));
        EXPECT_LT(norm(got.dc - want.dc), 1e-5) << count;
    }
}

TEST(MergeSplats, counts_are_exact_and_enough_is_the_same_scene) {
    SplatModel scene = sample_model(2, 300);
    scene.antialias = true;
    scene.origin = {1e6, -2e6, 3};
    scene.kernel = KERNEL_RAISED_COSINE;
    EXPECT_TRUE(same_splats(merge_splats(scene, 300), scene));
    EXPECT_TRUE(same_splats(merge_splats(scene, 1000), scene));
    EXPECT_EQ(merge_splats(SplatModel(), 5).size(), 0u);
    for (const std::size_t count : {299u, 298u, 225u, 150u, 17u, 2u, 1u}) {
        const SplatModel fewer = merge_splats(scene, count);
        EXPECT_EQ(fewer.size(), count);
        EXPECT_EQ(fewer.origin, scene.origin);
        EXPECT_TRUE(fewer.antialias);
        EXPECT_EQ(fewer.kernel, scene.kernel);
        EXPECT_EQ(fewer.sh_rest.size(), count * static_cast<std::size_t>(scene.rest_count()));
    }
    EXPECT_EQ(error_of([&] { merge_splats(scene, 0); }).find("no error"), std::string::npos);
    EXPECT_EQ(error_of([&] { merge_levels(scene, {10, 20}); }).find("no error"), std::string::npos);
}

TEST(MergeSplats, what_is_not_merged_keeps_its_bits) {
    const SplatModel scene = sample_model(1, 200);
    const SplatModel fewer = merge_splats(scene, 199);
    std::size_t same = 0;
    for (std::size_t i = 0; i < fewer.size(); ++i)
        for (const std::size_t from : {i, i + 1})
            same += same_splats(pick_splats(fewer, {static_cast<std::uint32_t>(i)}),
                                pick_splats(scene, {static_cast<std::uint32_t>(from)}));
    EXPECT_EQ(same, 198u);
}

TEST(MergeSplats, levels_follow_from_each_other_on_any_number_of_threads) {
    const SplatModel scene = sample_model(3, 3000);
    std::vector<double> shares;
    const auto levels =
        merge_levels(scene, {4000, 1500, 1500, 200},
                     {.threads = 1, .progress = [&](double share) { shares.push_back(share); }});
    ASSERT_EQ(levels.size(), 4u);
    EXPECT_TRUE(same_splats(levels[0], scene));
    EXPECT_TRUE(same_splats(levels[1], levels[2]));
    EXPECT_EQ(levels[3].size(), 200u);
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
    EXPECT_EQ(shares.back(), 1);
    const auto others = merge_levels(scene, {1500, 200}, {.threads = 3});
    EXPECT_TRUE(same_splats(others[0], levels[1]));
    EXPECT_TRUE(same_splats(others[1], levels[3]));
    EXPECT_THROW(merge_splats(scene, 10, {.progress = [](double) { throw 1; }}), int);
}

// Halves of the splats' mean area times opacity stay; pairs along the curve are near each other.
TEST(MergeSplats, quick_ones_keep_moments_and_merge_neighbours) {
    SplatModel scene = sample_model(0, 4096);
    const SplatModel half = merge_splats(scene, 2048, {.quick = true});
    ASSERT_EQ(half.size(), 2048u);
    EXPECT_EQ(half.position, merge_splats(scene, 2048, {.threads = 3, .quick = true}).position);
    const Whole before = whole_of(scene), after = whole_of(half);
    EXPECT_LT(norm(after.mean - before.mean), 0.1);
    EXPECT_LT(norm(after.dc - before.dc), 0.1 * norm(before.dc) + 0.05);
    scene.position[0] = std::numeric_limits<float>::quiet_NaN();
    for (const std::size_t count : {4096u, 4095u, 7u})
        EXPECT_EQ(merge_splats(scene, count, {.quick = true}).size(), count);
}

TEST(MergeSplats, a_square_becomes_a_disc_in_its_middle) {
    SplatModel four = translucent(4, 0);
    for (std::size_t i = 0; i < 4; ++i) {
        const float corner[] = {i % 2 ? 1.f : -1.f, i / 2 ? 1.f : -1.f, 0};
        for (std::size_t k = 0; k < 3; ++k) {
            four.position[3 * i + k] = corner[k];
            four.log_scale[3 * i + k] = k == 2 ? -15.f : -1.f;
            four.sh_dc[3 * i + k] = 0.25f;
        }
        for (std::size_t k = 0; k < 4; ++k) four.rotation[4 * i + k] = k == 0;
        four.opacity_logit[i] = -2;
    }
    const SplatModel one = merge_splats(four, 1);
    EXPECT_LT(norm(three(one.position, 0)), 1e-6);
    std::vector<float> scales = one.log_scale;
    std::ranges::sort(scales);
    EXPECT_LT(scales[0], -13);  // still flat
    const double side = 0.5 * std::log(std::exp(-2.0) + 1);
    EXPECT_NEAR(scales[1], side, 1e-6);
    EXPECT_NEAR(scales[2], side, 1e-6);
    EXPECT_NEAR(one.sh_dc[0], 0.25, 1e-7);
}

TEST(MergeSplats, opaque_splats_in_one_place_stay_opaque_and_grow_less_than_their_sum) {
    SplatModel many = sample_model(0, 8);
    for (std::size_t i = 1; i < 8; ++i)
        for (int a = 0; a < kAttributeCount; ++a) {
            const std::size_t floats = many.floats(a);
            std::copy_n(
                attribute_values(many, a).begin(), floats,
                attribute_values(many, a).begin() + static_cast<std::ptrdiff_t>(floats * i));
        }
    for (float& logit : many.opacity_logit) logit = 9;
    const SplatModel one = merge_splats(many, 1);
    EXPECT_NEAR(sigmoid(one.opacity_logit[0]), 0.99, 1e-6);
    const double grown = std::exp(2 *
                                  (one.log_scale[0] + one.log_scale[1] + one.log_scale[2] -
                                   many.log_scale[0] - many.log_scale[1] - many.log_scale[2]) /
                                  3);
    EXPECT_NEAR(grown, std::pow(8 / 0.99, 0.4), 2e-3);
}

TEST(MergeSplats, what_is_never_drawn_goes_first) {
    SplatModel scene = sample_model(1, 20);
    for (std::size_t k = 0; k < 4; ++k) scene.rotation[4 * 3 + k] = 0;
    scene.position[3 * 8] = std::numeric_limits<float>::quiet_NaN();
    scene.sh_rest[9 * 12] = std::numeric_limits<float>::infinity();
    std::vector<std::uint32_t> drawn;
    for (std::uint32_t i = 0; i < 20; ++i)
        if (i != 3 && i != 8 && i != 12) drawn.push_back(i);
    EXPECT_TRUE(same_splats(merge_splats(scene, 17), pick_splats(scene, drawn)));
    EXPECT_EQ(merge_splats(scene, 18).size(), 18u);
    const auto levels = merge_levels(scene, {19, 5});
    EXPECT_EQ(levels[0].size(), 19u);
    EXPECT_EQ(levels[1].size(), 5u);
    EXPECT_TRUE(all_finite_and_drawn(levels[1]));
}

TEST(MergeSplats, hard_splats_give_no_nan) {
    constexpr auto kHuge = 3e38f;
    for (const float hard : {-kHuge, -25.f, -20.f, 20.f, 25.f, kHuge})
        for (const bool log_scale : {true, false}) {
            SplatModel scene = sample_model(1, 60);
            for (std::size_t i = 0; i < 60; i += 2)
                if (log_scale)
                    for (std::size_t k = 0; k < i % 4 + 1; ++k) scene.log_scale[3 * i + k] = hard;
                else
                    scene.opacity_logit[i] = hard;
            for (std::size_t k = 3 * 40; k < 3 * 60; ++k) scene.position[k] = 0;  // in one place
            scene.position[0] = kHuge;
            scene.position[4] = -kHuge;
            for (const std::size_t count : {45u, 12u, 1u}) {
                const SplatModel fewer = merge_splats(scene, count);
                EXPECT_EQ(fewer.size(), count);
                EXPECT_TRUE(all_finite_and_drawn(fewer))
                    << hard << " " << log_scale << " " << count;
            }
        }
}

TEST(MergeSplats, no_density_of_identical_splats_is_too_much) {
    SplatModel scene = sample_model(0, 5000);
    std::fill(scene.position.begin(), scene.position.end(), 1.f);
    EXPECT_EQ(merge_splats(scene, 10).size(), 10u);
}

TEST(SecondMoment, exact_footprints_have_that_of_the_projected_kernel) {
    EXPECT_EQ(rendered_second_moment(KERNEL_GAUSSIAN, Footprint::psi), 1);
    EXPECT_EQ(rendered_second_moment(KERNEL_GAUSSIAN, Footprint::exact), 1);
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) {
        EXPECT_NEAR(rendered_second_moment(kernel, Footprint::exact), kernel_psi(kernel), 1e-12)
            << kernel_name(kernel);
        if (kernel == KERNEL_GAUSSIAN) continue;
        double mass = 0, moment = 0;  // by sums over q
        const double support = kernel_support(kernel), step = support / 200'000;
        for (double q = step / 2; q < support; q += step) {
            const double value = kernel_value(kernel, Footprint::psi, q);
            mass += value;
            moment += value * q / 2;
        }
        EXPECT_NEAR(rendered_second_moment(kernel, Footprint::psi),
                    covariance_scale(kernel, Footprint::psi) * moment / mass, 1e-6)
            << kernel_name(kernel);
    }
}

TEST(MergeMoments, error_is_zero_for_equals_in_one_place_and_grows_with_distance_and_colour) {
    SplatModel two = translucent(2, 0);
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::size_t floats = two.floats(a);
        std::copy_n(attribute_values(two, a).begin(), floats,
                    attribute_values(two, a).begin() + static_cast<std::ptrdiff_t>(floats));
    }
    const auto error_with = [&](double shift, double colour) {
        SplatMoments a = moments_of(two, 0), b = moments_of(two, 1);
        b.mean.x += shift * std::sqrt(b.covariance[0]);
        a.colour = glm::dvec3(0.5);
        b.colour = glm::dvec3(0.5 + colour);
        return merge_error(a, b, merge_moments(a, b, 1), 1) / (a.mass * a.mass);
    };
    const double large = error_with(8, 0);
    EXPECT_LT(error_with(0, 0), 1e-12 * large);
    EXPECT_GT(error_with(1, 0), error_with(0.5, 0));
    EXPECT_GT(error_with(0.5, 0), 1e-6 * large);
    EXPECT_GT(error_with(0.5, 0.3), error_with(0.5, 0.1));
    EXPECT_GT(error_with(0.5, 0.1), error_with(0.5, 0));
}

}  // namespace
}  // namespace darb::test
