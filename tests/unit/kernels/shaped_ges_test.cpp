// SPDX-License-Identifier: MIT
// The kernel ges_published: its program's factor, what that does to lengths, and the Gaussian that
// everything else equals.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/relocation_table.h"
#include "engine/kernels/shaped_kernel.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {
namespace {

const ShapedKernel& kGes = ges_kernel();

/// As in its program: 2 sigmoid(0.1 a), with a starting at 0.
double program_factor(double a) {
    return 2 / (1 + std::exp(-0.1 * a));
}

TEST(ShapedGes, Factor_isThatOfItsProgram) {
    for (const double a : {-40.0, -3.0, 0.0, 1.0, 25.0}) {
        const double t = kGes.exponent(Footprint::psi, a), f = program_factor(a), h = 1e-5;
        EXPECT_EQ(t, 2 + a);
        EXPECT_NEAR(kGes.covariance_scale(Footprint::psi, t), f * f, 1e-14);
        EXPECT_NEAR(kGes.length_slope(Footprint::psi, t),
                    (std::log(program_factor(a + h)) - std::log(program_factor(a - h))) / (2 * h),
                    1e-9);
        EXPECT_EQ(kGes.exponent_slope(Footprint::psi, a), 1);
        EXPECT_NEAR(kGes.second_moment(Footprint::psi, t), f * f, 1e-14);
        EXPECT_NEAR(kGes.gaussian(Footprint::psi, t, false).covariance / (f * f), 1, 1e-6);
        EXPECT_LT(kGes.gaussian(Footprint::psi, t, false).error, 1e-4);
    }
    EXPECT_EQ(kGes.covariance_scale(Footprint::psi, GES_START), 1);
}

TEST(ShapedGes, Profile_isTheGaussianOfEveryExponent) {
    for (const double t : kGes.exponents_to_check()) {
        for (double q = 0; q < 60; q += 0.73) {
            EXPECT_EQ(kGes.value(Footprint::psi, t, q).w, std::exp(-q / 2));
            EXPECT_EQ(kGes.value(Footprint::psi, t, q).slope, -std::exp(-q / 2) / 2);
            EXPECT_EQ(kGes.value(Footprint::psi, t, q).by_exponent, 0);
        }
        EXPECT_NEAR(kGes.reach(Footprint::psi, t, 0.6, 1 / 255.0), 2 * std::log(0.6 * 255), 1e-12);
        EXPECT_EQ(kGes.reach(Footprint::psi, t, 0.0039, 1 / 255.0), 0);
        EXPECT_NEAR(kGes.relocation_scale(Footprint::psi, t, 0.7, 4),
                    relocation_scale(KERNEL_GAUSSIAN, Footprint::psi, 0.7, 4), 1e-6);
    }
    const auto own = kGes.radius_quantiles(Footprint::psi, 7, 50);
    for (int k = 0; k < 50; ++k)
        EXPECT_NEAR(own[static_cast<std::size_t>(k)],
                    kernel_radius_quantile(KERNEL_GAUSSIAN, (k + 0.5) / 50), 1e-4);
}

TEST(ShapedGes, Exponent_isHeldWhereTheProgramPrunes) {
    EXPECT_EQ(kGes.exponent(Footprint::psi, -1000), GES_LEAST);
    EXPECT_EQ(kGes.exponent(Footprint::psi, 1000), GES_MOST);
    EXPECT_EQ(kGes.exponent_slope(Footprint::psi, -1000), 0);
    EXPECT_EQ(kGes.exponent_slope(Footprint::psi, 1000), 0);
    EXPECT_NEAR(std::sqrt(kGes.covariance_scale(Footprint::psi, GES_LEAST)), 0.005, 1e-4);
    EXPECT_FALSE(has_exact_footprint(KERNEL_GES_PUBLISHED));
    EXPECT_EQ(kernel_from_name("ges_published"), KERNEL_GES_PUBLISHED);
}

}  // namespace
}  // namespace darb
