// SPDX-License-Identifier: MIT
// The profile that training changes: it is a kernel whatever its parameters, its gradients are
// those of central differences, and the optimizer finds a profile that it is drawn towards.
#include "engine/kernels/learned_profile.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb {
namespace {

constexpr Footprint kFootprints[] = {Footprint::psi, Footprint::exact};

/// With logits spread over `spread` to both sides.
LearnedProfile random_profile(int start, std::uint64_t seed, double spread) {
    LearnedProfile profile(start);
    Pcg32 rng(seed);
    auto logits = profile.logits();
    for (float& logit : logits) logit = static_cast<float>(rng.uniform(-spread, spread));
    profile.set_logits(logits);
    return profile;
}

TEST(LearnedProfile, any_parameters_give_a_falling_kernel_that_darb_takes) {
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
        SCOPED_TRACE(seed);
        const LearnedProfile profile =
            random_profile(KERNEL_GAUSSIAN, seed, seed % 3 == 0 ? 12 : 3);
        const int kernel = register_kernel(profile.definition());  // throws where it is none
        EXPECT_TRUE(kernel_name(kernel).starts_with("learned_"));
        EXPECT_TRUE(has_exact_footprint(kernel));
        EXPECT_NEAR(kernel_support(kernel), profile.support(), 1e-12 * profile.support());
        EXPECT_NEAR(kernel_psi(kernel), 1, 1e-9) << "that of the start";
        for (const Footprint footprint : kFootprints) {
            EXPECT_NEAR(profile.value(footprint, 0), 1, 1e-12);
            EXPECT_EQ(profile.value(footprint, profile.support()), 0);
            double before = 1;
            for (int i = 1; i < 400; ++i) {
                const double q = profile.support() * i / 400, w = profile.value(footprint, q);
                EXPECT_LT(w, before + 1e-15);
                EXPECT_GT(w, 0);
                EXPECT_NEAR(w, kernel_value(kernel, footprint, q), 1e-9) << "q = " << q;
                before = w;
            }
        }
    }
}

TEST(LearnedProfile, starts_near_the_kernel_that_it_is_to_start_from) {
    const std::pair<int, double> most[] = {{KERNEL_GAUSSIAN, 0.02},
                                           {KERNEL_RAISED_COSINE, 0.01},
                                           {KERNEL_SINC, 0.01},
                                           {KERNEL_PARABOLIC, 0.01},
                                           {KERNEL_COSINE, 0.01},
                                           {KERNEL_HALF_COSINE_SQUARED, 0.01},
                                           {KERNEL_SQUARED_RAISED_COSINE, 0.01}};
    for (const auto& [kernel, distance] : most) {
        const LearnedProfile profile(kernel);
        EXPECT_LT(profile.distance_from_start(), distance) << kernel_name(kernel);
        EXPECT_NEAR(kernel_psi(register_kernel(profile.definition())), kernel_psi(kernel), 1e-9);
    }
    // A jump at the edge is out of reach: the profile still begins.
    EXPECT_LT(LearnedProfile(KERNEL_INVERSE_QUADRATIC).distance_from_start(), 0.15);
}

TEST(LearnedProfile, derivatives_are_those_of_central_differences) {
    constexpr float kStep = 1.0f / 1024;
    const LearnedProfile profile = random_profile(KERNEL_RAISED_COSINE, 7, 2);
    for (const Footprint footprint : kFootprints)
        for (const double share : {0.02, 0.3, 0.7, 0.95}) {
            const double q = share * profile.support();
            const auto got = profile.by_logits(footprint, q);
            for (std::size_t j = 0; j < got.size(); ++j) {
                const auto at = [&](float step) {
                    LearnedProfile moved = profile;
                    auto logits = profile.logits();
                    logits[j] += step;
                    moved.set_logits(logits);
                    return moved.value(footprint, q);
                };
                const double difference = (at(kStep) - at(-kStep)) / (2 * kStep);
                EXPECT_NEAR(got[j], difference, 1e-6) << footprint_name(footprint) << " " << j;
            }
        }
}

/// What the shaders leave of samples with these q and G.
std::vector<float> sums_of(const std::vector<std::pair<double, double>>& samples, double support) {
    std::vector<double> sums(PROFILE_SUMS, 0.0);
    for (const auto& [q, g] : samples)
        for (std::size_t k = 0; k < sums.size(); ++k)
            sums[k] += g * std::cos(static_cast<double>(k) *
                                    std::acos(2 * std::sqrt(1 - q / support) - 1));
    return {sums.begin(), sums.end()};
}

TEST(LearnedProfile, sums_over_samples_give_the_gradient) {
    const LearnedProfile profile = random_profile(KERNEL_GAUSSIAN, 3, 2);
    std::vector<std::pair<double, double>> samples;
    Pcg32 rng(5);
    for (int i = 0; i < 60; ++i)
        samples.emplace_back(rng.uniform(0, 0.9) * profile.support(), rng.uniform(-1, 1));
    const std::vector<float> sums = sums_of(samples, profile.support());
    for (const Footprint footprint : kFootprints) {
        LearnedProfile::Values expected{};
        double scale = 0;
        for (const auto& [q, g] : samples) {
            const auto each = profile.by_logits(footprint, q);
            for (std::size_t j = 0; j < each.size(); ++j) {
                expected[j] += g * each[j];
                scale = std::max(scale, std::abs(g * each[j]));
            }
        }
        const auto got = profile.gradient(footprint, sums);
        for (std::size_t j = 0; j < got.size(); ++j)
            EXPECT_NEAR(got[j], expected[j], 1e-5 * scale) << footprint_name(footprint) << " " << j;
    }
}

/// Sums for the loss sum over a grid of (w - target)^2, and that loss.
std::pair<std::vector<float>, double> pull(const LearnedProfile& profile, Footprint footprint,
                                           int target) {
    std::vector<std::pair<double, double>> samples;
    double loss = 0;
    for (int i = 0; i < 100; ++i) {
        const double q = 0.06 * i;
        const double away = profile.value(footprint, q) - kernel_value(target, footprint, q);
        if (q < profile.support()) samples.emplace_back(q, 2 * away);
        loss += away * away;
    }
    return {sums_of(samples, profile.support()), loss};
}

TEST(ProfileOptimizer, finds_a_profile_that_it_is_drawn_towards_and_goes_on_from_its_state) {
    for (const Footprint footprint : kFootprints) {
        ProfileOptimizer optimizer(KERNEL_PARABOLIC, footprint, 0.3);
        // With the second moment of the start: the parabola's, not the cosine's.
        const double support =
            6.25 * kernel_psi(KERNEL_PARABOLIC) / kernel_psi(KERNEL_RAISED_COSINE);
        const int target = register_kernel("wide_cosine", support, [&](double q) {
            return kernel_value(KERNEL_RAISED_COSINE, Footprint::psi, q * 6.25 / support);
        });
        const double first = pull(optimizer.profile(), footprint, target).second;
        ProfileOptimizer second(KERNEL_PARABOLIC, footprint, 0.3);
        for (int i = 0; i < 30; ++i) {
            if (i == 11) second.restore(optimizer.state());
            const auto sums = pull(optimizer.profile(), footprint, target).first;
            optimizer.step(sums);
            if (i >= 11) second.step(sums);
        }
        EXPECT_LT(pull(optimizer.profile(), footprint, target).second, first / 30);
        EXPECT_EQ(second.state(), optimizer.state());
        EXPECT_EQ(second.kernel(), optimizer.kernel());
    }
}

TEST(ProfileOptimizer, nothing_and_what_is_not_finite_change_nothing) {
    ProfileOptimizer optimizer(KERNEL_GAUSSIAN, Footprint::psi, 0.3);
    const std::vector<float> before = optimizer.state();
    std::vector<float> sums(PROFILE_SUMS, 0.0f);
    optimizer.step(sums);
    EXPECT_EQ(optimizer.state(), before);
    sums[3] = NAN;
    optimizer.step(sums);
    EXPECT_EQ(optimizer.state(), before);
    EXPECT_THROW(optimizer.restore({1, 2, 3}), Error);
    std::vector<float> bad = before;
    bad[2] = NAN;
    EXPECT_THROW(optimizer.restore(bad), Error);
}

TEST(LearnedProfile, kernels_of_another_nature_are_refused_as_a_start) {
    for (const int kernel :
         {int{KERNEL_BETA}, blend_of(KERNEL_GAUSSIAN, KERNEL_SINC), int{KERNEL_SINC_2_PULSES}}) {
        EXPECT_NE(LearnedProfile::fault_of_start(kernel), "") << kernel_name(kernel);
        EXPECT_THROW(LearnedProfile{kernel}, Error) << kernel_name(kernel);
    }
}

}  // namespace
}  // namespace darb
