// SPDX-License-Identifier: MIT
// Blends of two kernels with a weight per splat: both ends, derivatives and integrals.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/kernels/kernel_expression.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/relocation_table.h"
#include "tests/support/every_kernel.h"
#include "tests/support/footprints.h"

namespace darb::test {
namespace {

constexpr int kBlends[] = {kSmoothBlend, kSteepBlend};

TEST(ShapedBlend, Names_areOfTwoKernelsOfTheList) {
    EXPECT_EQ(kernel_name(kSmoothBlend), "blend:gaussian,raised_cosine");
    EXPECT_EQ(kernel_from_name("blend:gaussian,raised_cosine"), kSmoothBlend);
    EXPECT_EQ(kernel_from_name("blend: gaussian, raised_cosine "), kSmoothBlend);
    for (int k = 0; k < KERNEL_COUNT; ++k)
        for (int j = 0; j < KERNEL_COUNT; ++j) {
            const int blend = blend_of(k, j);
            EXPECT_EQ(kernel_has_shape(blend), k != j);
            if (k == j) continue;
            EXPECT_EQ(kernel_from_name(kernel_name(blend)), blend);
        }
    for (const char* none : {"blend:", "blend:gaussian", "blend:gaussian,gaussian",
                             "blend:sinc,beta", "blend:sinc,no", "blend:sinc,cosine,parabolic"})
        EXPECT_FALSE(kernel_from_name(none)) << none;
    const std::vector<std::string> three{"sinc", "blend:gaussian,raised_cosine", "beta"};
    EXPECT_EQ(split_kernel_list("sinc, blend:gaussian, raised_cosine, beta"), three);
}

TEST(ShapedBlend, Ends_areTheTwoKernels) {
    for (const int id : kBlends)
        for (const Footprint f : kFootprints)
            for (const int end : {0, 1}) {
                const ShapedKernel& blend = shaped_kernel(id);
                const int k = (*blend_parts(id))[static_cast<std::size_t>(end)];
                const double m = blend.exponent(f, end == 0 ? -100 : 100);
                EXPECT_NEAR(m, end, 1e-12);
                for (double q = 0; q < 12; q += 0.37) {
                    EXPECT_NEAR(blend.value(f, m, q).w, kernel_value(k, f, q), 1e-12);
                    EXPECT_NEAR(blend.value(f, m, q).slope, kernel_slope(k, f, q), 1e-9);
                }
                EXPECT_NEAR(blend.reach(f, m, 0.6, 1 / 255.0), kernel_reach(k, f, 0.6, 1 / 255.0),
                            1e-6);
                EXPECT_NEAR(blend.covariance_scale(f, m), covariance_scale(k, f), 1e-9);
                EXPECT_NEAR(blend.second_moment(f, m), rendered_second_moment(k, f), 1e-6);
                EXPECT_NEAR(blend.relocation_scale(f, m, 0.7, 4), relocation_scale(k, f, 0.7, 4),
                            2e-3);
                const auto quantiles = blend.radius_quantiles(f, m, 20);
                for (int i = 0; i < 20; ++i)
                    EXPECT_NEAR(quantiles[static_cast<std::size_t>(i)],
                                kernel_radius_quantile(k, (i + 0.5) / 20), 1e-3);
                EXPECT_NEAR(blend.gaussian(f, m, true).covariance,
                            gaussian_equivalent(k, f, true).covariance, 5e-3);
            }
}

TEST(ShapedBlend, Exact_is_not_there_where_a_quadric_ends_inside_the_other_kernel) {
    EXPECT_TRUE(has_exact_footprint(*kernel_from_name("blend:gaussian,raised_cosine")));
    EXPECT_TRUE(has_exact_footprint(*kernel_from_name("blend:sinc,inverse_quadratic")));
    EXPECT_FALSE(has_exact_footprint(*kernel_from_name("blend:gaussian,inverse_quadratic")));
    EXPECT_FALSE(has_exact_footprint(*kernel_from_name("blend:inverse_multiquadric,gaussian")));
}

TEST(ShapedBlend, Derivatives_matchDifferences) {
    for (const int id : kBlends)
        for (const Footprint f : kFootprints) {
            const ShapedKernel& blend = shaped_kernel(id);
            for (const double m : {0.1, 0.5, 0.8})
                for (const double q : {0.0, 1e-6, 0.3, 2.0, 6.0, 8.5}) {
                    const ShapedValue at = blend.value(f, m, q);
                    const auto w = [&](double x, double y) { return blend.value(f, x, y).w; };
                    EXPECT_NEAR(at.by_exponent, (w(m + 1e-6, q) - w(m - 1e-6, q)) / 2e-6, 1e-9);
                    if (q < 1e-3) continue;
                    EXPECT_NEAR(at.slope, (w(m, q + 1e-6) - w(m, q - 1e-6)) / 2e-6, 1e-7) << q;
                }
            EXPECT_NEAR(blend.value(f, 0.3, 0).w, 1, 1e-15);
            for (const double s : {-4.0, -0.5, 0.0, 2.0}) {
                const double d = (blend.exponent(f, s + 1e-6) - blend.exponent(f, s - 1e-6)) / 2e-6;
                EXPECT_NEAR(blend.exponent_slope(f, s), d, 1e-8);
            }
            EXPECT_EQ(blend.exponent_slope(f, 40), 0);
            for (const double m : {0.2, 0.7}) {
                const auto half_log = [&](double x) {
                    return std::log(blend.covariance_scale(f, x)) / 2;
                };
                const double d = (half_log(m + 1e-6) - half_log(m - 1e-6)) / 2e-6;
                EXPECT_NEAR(blend.length_slope(f, m), d, 1e-7);
            }
        }
}

// The exact footprint draws the line integral of the blend in space.
TEST(ShapedBlend, ExactFootprint_isTheLineIntegral) {
    for (const int id : kBlends)
        for (const double shape : {-1.0, 0.4}) {
            const ShapedKernel& blend = shaped_kernel(id);
            const double space = blend.exponent(Footprint::psi, shape);
            const double drawn = blend.exponent(Footprint::exact, shape);
            const auto line = [&](double q) {
                double sum = 0;
                for (double z = 0.0005; z < 9; z += 0.001)
                    sum += blend.value(Footprint::psi, space, q + z * z).w;
                return sum;
            };
            for (const double q : {0.4, 3.0, 7.5})
                EXPECT_NEAR(blend.value(Footprint::exact, drawn, q).w, line(q) / line(0), 2e-4)
                    << q;
        }
}

TEST(ShapedBlend, Reach_isWhereTheCutoffIs) {
    const ShapedKernel& blend = shaped_kernel(kSmoothBlend);
    for (const Footprint f : kFootprints)
        for (const double m : {0.0, 0.3, 0.9})
            for (const double opacity : {0.004, 0.05, 1.0}) {
                const double q = blend.reach(f, m, opacity, 1 / 255.0);
                EXPECT_NEAR(opacity * blend.value(f, m, q).w, 1 / 255.0, 1e-10);
            }
    EXPECT_EQ(blend.reach(Footprint::psi, 0.5, 0.0039, 1 / 255.0), 0);
}

}  // namespace
}  // namespace darb::test
