// SPDX-License-Identifier: MIT
// Density control on the device against the decisions of the reference: which splats stay and grow,
// where new splats come from and lie, and what happens to their moments.
#include <fmt/format.h>

#include <algorithm>

#include "engine/core/rng.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/raster/backward.h"
#include "engine/reference/reference_density_control.h"
#include "engine/scene/splat_model.h"
#include "tests/support/every_kernel.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"
#include "trainer/growth/density_control.h"

namespace darb::test {
namespace {

using reference::DensityAction;

struct Generation {
    SplatModel model;
    std::array<std::vector<float>, kAttributeCount> moments;
    std::vector<float> rest_sum;
};

constexpr std::uint32_t kNoLimit = 0xffffffff;

struct Population {
    SplatModel model;
    std::vector<glm::vec2> gradient_sum;  // sum of norms, frames

    explicit Population(size_t count, std::uint64_t seed = 71)
        : model(random_scene({.count = count,
                              .sh_degree = 1,
                              .min_log_scale = -7,
                              .max_log_scale = 1,
                              .min_logit = -8,
                              .max_logit = 3,
                              .seed = seed})
                    .model) {
        Pcg32 rng(seed + 1);
        for (size_t i = 0; i < count; ++i) {
            const auto frames = static_cast<float>(rng.below(20));
            gradient_sum.emplace_back(frames * rng.uniform(0, 4e-4), frames);
        }
    }

    /// Moments are 1, 2, 3, ..., so that each can be recognised.
    Generation run(const gpu::DensifyArgs& args, DensityResult& result,
                   int kernel = KERNEL_GAUSSIAN, std::uint32_t max_splats = kNoLimit,
                   Footprint footprint = Footprint::psi,
                   std::span<const std::uint8_t> fixed = {}) const {
        Device& device = shared_device();
        GpuSplats splats(device, model, true, true);
        for (int a = 0; a < kAttributeCount; ++a) splats.upload_moments(a, moments_before(a));
        const std::vector<float> ones(model.sh_rest.size(), 1.0f);
        if (!ones.empty()) splats.upload_rest_sum(ones);
        Buffer sums(device, "gradient sum", std::max<size_t>(model.size(), 1) * 8);
        if (!gradient_sum.empty()) sums.upload(gradient_sum);
        DensityControl density(device, kernel, footprint);
        result = density.run(splats, sums, args, max_splats, fixed);
        Generation g{splats.download(), {}, {}};
        const size_t rest = g.model.size() * stride(kShRest);
        if (rest > 0) g.rest_sum = splats.download_rest_sum();
        for (int a = 0; a < kAttributeCount; ++a) g.moments[a] = splats.download_moments(a);
        return g;
    }
    size_t stride(int attribute) const {
        return attribute_values(model, attribute).size() / std::max<size_t>(model.size(), 1);
    }
    std::vector<float> moments_before(int attribute) const {
        std::vector<float> moments(attribute_values(model, attribute).size() * 2);
        for (size_t i = 0; i < moments.size(); ++i) moments[i] = static_cast<float>(i + 1);
        return moments;
    }
    std::vector<DensityAction> actions(const reference::DensitySettings& settings) const {
        std::vector<double> sums;
        std::vector<std::uint32_t> seen;
        for (const glm::vec2& g : gradient_sum) {
            sums.push_back(g.x);
            seen.push_back(static_cast<std::uint32_t>(g.y));
        }
        return reference::density_actions(sums, seen, model.log_scale, model.opacity_logit,
                                          settings);
    }
};

gpu::DensifyArgs args_for(const reference::DensitySettings& s) {
    gpu::DensifyArgs args{};
    args.gradient_threshold = static_cast<float>(s.gradient_threshold);
    args.clone_split_scale = static_cast<float>(s.split_scale_share * s.scene_extent);
    args.prune_opacity = static_cast<float>(s.min_opacity);
    args.prune_scale = s.prune_wide ? static_cast<float>(s.max_scale_share * s.scene_extent) : 0;
    args.seed = 12345;
    return args;
}

struct Source {
    std::uint32_t splat;
    DensityAction role;  // keep: as it was; clone: a copy; split: a child
};

/// Kept splats and first children in file order, then copies and second children.
std::vector<Source> sources_of(const std::vector<DensityAction>& actions) {
    std::vector<Source> stay, added;
    for (std::uint32_t i = 0; i < actions.size(); ++i) {
        if (actions[i] == DensityAction::remove) continue;
        const bool splits = actions[i] == DensityAction::split;
        stay.push_back({i, splits ? DensityAction::split : DensityAction::keep});
        if (splits || actions[i] == DensityAction::clone) added.push_back({i, actions[i]});
    }
    stay.insert(stay.end(), added.begin(), added.end());
    return stay;
}

void expect_generation(const Population& before, const std::vector<Source>& sources,
                       const Generation& after) {
    ASSERT_EQ(after.model.size(), sources.size());
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& from = attribute_values(before.model, a);
        const std::vector<float>& to = attribute_values(after.model, a);
        const std::vector<float> moments = before.moments_before(a);
        const size_t stride = before.stride(a);
        for (size_t i = 0; i < sources.size(); ++i) {
            const bool split = sources[i].role == DensityAction::split;
            for (size_t c = 0; c < stride; ++c) {
                const size_t at = i * stride + c, source = sources[i].splat * stride + c;
                const std::string where = fmt::format("{} [{}][{}]", attribute_name(a), i, c);
                if (split && a == kLogScale) {
                    ASSERT_NEAR(to[at], reference::split_log_scale(from[source]), 1e-6) << where;
                } else if (!split || a != kPosition) {  // for positions see the offsets below
                    ASSERT_EQ(to[at], from[source]) << where;
                }
                const bool old = sources[i].role == DensityAction::keep;
                for (size_t m = 0; m < 2; ++m)
                    ASSERT_EQ(after.moments[a][2 * at + m], old ? moments[2 * source + m] : 0)
                        << where << " moment " << m;
                if (a == kShRest) {
                    ASSERT_EQ(after.rest_sum[at], old ? 1 : 0) << where << " sum";
                }
            }
        }
    }
}

TEST(Densify, decisions_and_the_next_generation_match_the_reference) {
    for (const bool prune_wide : {false, true}) {
        SCOPED_TRACE(prune_wide ? "with the width limit" : "without");
        const Population population(1000);
        reference::DensitySettings settings;
        settings.scene_extent = 5;
        settings.prune_wide = prune_wide;
        const std::vector<DensityAction> actions = population.actions(settings);
        for (const DensityAction action : {DensityAction::keep, DensityAction::clone,
                                           DensityAction::split, DensityAction::remove})
            ASSERT_GT(std::count(actions.begin(), actions.end(), action), 30);
        DensityResult result;
        const Generation after = population.run(args_for(settings), result);
        EXPECT_EQ(result.before, 1000U);
        EXPECT_EQ(result.after, reference::count_after(actions));
        EXPECT_EQ(result.pruned, std::count(actions.begin(), actions.end(), DensityAction::remove));
        EXPECT_EQ(result.after, result.before - result.pruned + result.grown);
        expect_generation(population, sources_of(actions), after);
    }
}

TEST(Densify, nothing_to_do_leaves_every_bit) {
    const Population population(100);
    gpu::DensifyArgs args = args_for({});
    args.gradient_threshold = 1;
    args.prune_opacity = 0;
    DensityResult result;
    const Generation after = population.run(args, result);
    EXPECT_EQ(result.after, 100U);
    expect_generation(population, sources_of(std::vector(100, DensityAction::keep)), after);
}

TEST(Densify, growth_stops_at_the_limit_largest_gradients_first) {
    const Population population(1000);
    reference::DensitySettings settings;
    settings.scene_extent = 5;
    const auto unlimited = reference::count_after(population.actions(settings));
    for (const std::uint32_t limit : {1U, 700U, 1000U, 1050U}) {
        SCOPED_TRACE(limit);
        settings.max_splats = limit;
        const std::vector<DensityAction> actions = population.actions(settings);
        ASSERT_LT(reference::count_after(actions), unlimited) << "the limit must bite";
        DensityResult result;
        const Generation after = population.run(args_for(settings), result, KERNEL_GAUSSIAN, limit);
        EXPECT_EQ(result.after, reference::count_after(actions));
        expect_generation(population, sources_of(actions), after);
    }
}

TEST(Densify, fixed_splats_are_pruned_and_do_not_grow) {
    const Population population(1000);
    const reference::DensitySettings settings;
    std::vector<std::uint8_t> fixed(1000);
    std::vector<DensityAction> actions = population.actions(settings);
    std::size_t stopped = 0;
    for (std::size_t i = 0; i < fixed.size(); ++i) {
        fixed[i] = i % 3 == 0 ? 1 : 0;
        if (fixed[i] == 0 || actions[i] == DensityAction::remove) continue;
        stopped += actions[i] == DensityAction::keep ? 0 : 1;
        actions[i] = DensityAction::keep;
    }
    ASSERT_GT(stopped, 10U);
    DensityResult result;
    const Generation after = population.run(args_for(settings), result, KERNEL_GAUSSIAN, kNoLimit,
                                            Footprint::psi, fixed);
    EXPECT_EQ(result.after, reference::count_after(actions));
    expect_generation(population, sources_of(actions), after);
}

TEST(Densify, pruning_everything_leaves_an_empty_model) {
    const Population population(200);
    gpu::DensifyArgs args = args_for({});
    args.prune_opacity = 1.1f;
    DensityResult result;
    const Generation after = population.run(args, result);
    EXPECT_EQ(result.pruned, 200U);
    EXPECT_EQ(result.after, 0U);
    EXPECT_EQ(after.model.size(), 0U);
}

TEST(Densify, an_empty_model_stays_empty) {
    const Population population(0);
    DensityResult result;
    EXPECT_EQ(population.run(args_for({}), result).model.size(), 0U);
    EXPECT_EQ(result.after, 0U);
}

TEST(Densify, values_that_are_not_finite_do_not_grow) {
    Population population(6);
    population.model.opacity_logit.assign(6, 0.0f);
    population.model.log_scale.assign(18, -3.0f);
    population.gradient_sum.assign(6, glm::vec2(1, 1));
    population.gradient_sum[0].x = std::nanf("");
    population.gradient_sum[1] = glm::vec2(1, 0);       // never seen
    population.model.opacity_logit[2] = std::nanf("");  // pruned
    DensityResult result;
    population.run(args_for({}), result);
    EXPECT_EQ(result.pruned, 1U);
    EXPECT_EQ(result.grown, 3U);
}

/// Offsets of children from their parent, in the parent's frame and in units of its scale. shape:
/// that of all parents, where the kernel has shapes.
std::vector<glm::dvec3> child_offsets(int kernel, size_t parents, std::uint32_t seed,
                                      Footprint footprint = Footprint::psi, float shape = 0) {
    Population population(parents);
    set_kernel(population.model, kernel);
    for (float& value : population.model.shape) value = shape;
    const float log_scale[] = {0.5f, -1.0f, 0.1f}, rotation[] = {0.9f, 0.3f, -0.5f, 0.2f};
    for (size_t i = 0; i < parents; ++i) {
        for (size_t c = 0; c < 3; ++c) population.model.position[i * 3 + c] = 1;
        std::copy_n(log_scale, 3, population.model.log_scale.begin() + std::ptrdiff_t(i * 3));
        std::copy_n(rotation, 4, population.model.rotation.begin() + std::ptrdiff_t(i * 4));
        population.model.opacity_logit[i] = 1;
        population.gradient_sum[i] = glm::vec2(1, 1);
    }
    gpu::DensifyArgs args = args_for({});
    args.seed = seed;
    DensityResult result;
    const Generation after = population.run(args, result, kernel, kNoLimit, footprint);
    for (const float value : after.model.shape) EXPECT_EQ(value, shape) << "children keep it";
    EXPECT_EQ(after.model.size(), 2 * parents);
    glm::dmat3 axes;  // images of the unit vectors
    for (int c = 0; c < 3; ++c) {
        glm::dvec3 unit(0);
        unit[c] = 1;
        axes[c] = reference::split_offset(rotation, log_scale, unit, 1);
    }
    const glm::dmat3 inverse = glm::inverse(axes);
    std::vector<glm::dvec3> offsets;
    for (size_t i = 0; i < after.model.size(); ++i) {
        const float* p = &after.model.position[i * 3];
        offsets.push_back(inverse * glm::dvec3(p[0] - 1.0, p[1] - 1.0, p[2] - 1.0));
    }
    return offsets;
}

TEST(Densify, offsets_of_children_follow_the_density_of_their_own_shape) {
    for (const int kernel : every_shaped_kernel())
        for (const float shape : {-3.0f, -0.6f, 0.0f, 1.1f, 4.0f}) {  // the outer ones are held
            SCOPED_TRACE(fmt::format("{} {}", kernel_name(kernel), shape));
            const Footprint footprint =
                has_exact_footprint(kernel) ? Footprint::exact : Footprint::psi;
            const auto offsets = child_offsets(kernel, 10'000, 7, footprint, shape);
            const auto radii = shaped_kernel(kernel).radius_quantiles(
                footprint, splat_exponent(kernel, footprint, static_cast<double>(shape)), 20);
            for (const int k : {1, 5, 10, 14, 18}) {
                const auto below = std::count_if(offsets.begin(), offsets.end(), [&](auto& o) {
                    return length(o) < radii[static_cast<size_t>(k)];
                });
                EXPECT_NEAR(double(below) / 20'000, (k + 0.5) / 20, 0.015) << k;
            }
        }
}

TEST(Densify, offsets_of_children_follow_the_kernels_radial_density) {
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) {
        SCOPED_TRACE(std::string(kernel_name(kernel)));
        const std::vector<glm::dvec3> offsets = child_offsets(kernel, 10'000, 7);
        for (const double p : {0.05, 0.2, 0.4, 0.6, 0.8, 0.95}) {
            const double radius = kernel_radius_quantile(kernel, p);
            const auto below = std::count_if(offsets.begin(), offsets.end(),
                                             [&](const auto& o) { return length(o) < radius; });
            EXPECT_NEAR(double(below) / 20'000, p, 0.012) << "quantile " << p;  // 3.4 sigma
        }
        glm::dvec3 mean(0);
        glm::dmat3 second(0.0);
        for (const glm::dvec3& o : offsets) {
            const glm::dvec3 direction = glm::normalize(o);
            mean += direction / 20'000.0;
            second += glm::outerProduct(direction, direction) / 20'000.0;
        }
        for (int r = 0; r < 3; ++r) {
            EXPECT_NEAR(mean[r], 0, 0.015) << "axis " << r;
            for (int c = 0; c < 3; ++c) EXPECT_NEAR(second[r][c], r == c ? 1 / 3.0 : 0, 0.01);
        }
    }
}

TEST(Densify, offsets_repeat_with_the_seed_and_differ_between_seeds_and_siblings) {
    const auto one = child_offsets(KERNEL_RAISED_COSINE, 500, 7);
    const auto same = child_offsets(KERNEL_RAISED_COSINE, 500, 7);
    const auto other = child_offsets(KERNEL_RAISED_COSINE, 500, 8);
    EXPECT_EQ(one, same);
    for (size_t i = 0; i < 500; ++i) {
        EXPECT_NE(one[i], one[500 + i]) << "siblings " << i;
        EXPECT_NE(one[i], other[i]) << i;
    }
}

TEST(ResetOpacity, opacities_come_down_and_moments_are_zero) {
    const Population population(300);
    Device& device = shared_device();
    GpuSplats splats(device, population.model, true);
    for (int a = 0; a < kAttributeCount; ++a)
        splats.upload_moments(a, population.moments_before(a));
    DensityControl density(device, KERNEL_GAUSSIAN);
    density.reset_opacity(splats, static_cast<float>(reference::kResetOpacity));
    const SplatModel after = splats.download();
    int lowered = 0;
    for (size_t i = 0; i < 300; ++i) {
        EXPECT_FLOAT_EQ(after.opacity_logit[i],
                        reference::reset_opacity(population.model.opacity_logit[i]));
        lowered += after.opacity_logit[i] != population.model.opacity_logit[i];
    }
    EXPECT_GT(lowered, 100);
    EXPECT_LT(lowered, 300);
    EXPECT_EQ(splats.download_moments(kOpacityLogit), std::vector<float>(600, 0.0f));
    EXPECT_EQ(splats.download_moments(kShDc), population.moments_before(kShDc));
    EXPECT_EQ(after.position, population.model.position);
}

}  // namespace
}  // namespace darb::test
