// SPDX-License-Identifier: MIT
// The kernel with a shape per splat: closed forms against differences and integrals, and at the
// start shape against the row of the family.
#include "engine/kernels/shaped_kernel.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/relocation_table.h"
#include "shaders/shared/kernel_forms.h"
#include "tests/support/footprints.h"

namespace darb {
namespace {

constexpr double kR2 = BETA_SUPPORT;
const ShapedKernel& kBeta = beta_kernel();

/// Midpoint sums of f over [0, to].
template <class F>
double integral(double to, const F& f, int steps = 200'000) {
    double sum = 0;
    for (int i = 0; i < steps; ++i) sum += f(to * (i + 0.5) / steps);
    return sum * to / steps;
}

TEST(ShapedKernel, Start_isTheRowOfTheFamily) {
    for (const Footprint f : test::kFootprints) {
        const double e = kBeta.exponent(f, 0);
        EXPECT_EQ(e, f == Footprint::psi ? 4 : 4.5);
        for (double q = 0; q < 14; q += 0.37) {
            EXPECT_NEAR(kBeta.value(f, e, q).w, kernel_value(KERNEL_BETA, f, q), 1e-13) << q;
            EXPECT_NEAR(kBeta.value(f, e, q).slope, kernel_slope(KERNEL_BETA, f, q), 1e-12) << q;
        }
        EXPECT_NEAR(kBeta.reach(f, e, 0.6, 1 / 255.0), kernel_reach(KERNEL_BETA, f, 0.6, 1 / 255.0),
                    1e-12);
        EXPECT_NEAR(kBeta.covariance_scale(f, e), covariance_scale(KERNEL_BETA, f), 1e-13);
        EXPECT_NEAR(kBeta.second_moment(f, e), rendered_second_moment(KERNEL_BETA, f), 1e-12);
        EXPECT_NEAR(kBeta.relocation_scale(f, e, 0.7, 4), relocation_scale(KERNEL_BETA, f, 0.7, 4),
                    1e-12);
        const auto quantiles = kBeta.radius_quantiles(f, e, 50);
        for (int k = 0; k < 50; ++k)
            EXPECT_NEAR(quantiles[static_cast<std::size_t>(k)],
                        kernel_radius_quantile(KERNEL_BETA, (k + 0.5) / 50), 1e-5);
        const auto own = kBeta.gaussian(f, e, false),
                   row = gaussian_equivalent(KERNEL_BETA, f, false);
        EXPECT_NEAR(own.covariance, row.covariance, 1e-12);
        EXPECT_NEAR(own.error, row.error, 1e-9);
    }
    EXPECT_NEAR(kernel_psi(KERNEL_BETA), 1, 1e-13) << "the Gaussian's second moment";
}

TEST(ShapedKernel, Derivatives_matchDifferencesFromCentreToEdge) {
    for (const double e : {1.0, 1.5, 4.0, 20.0, 64.0})
        for (const double q : {0.0, 1e-9, 0.3, 2.0, 7.0, 12.9, kR2 * (1 - 1e-7), kR2, 20.0}) {
            const ShapedValue at = kBeta.value(Footprint::psi, e, q);
            const double h = 1e-4 * (kR2 - q), k = 1e-6;
            if (q < kR2 && q > 1e-6) {
                const double d = (kBeta.value(Footprint::psi, e, q + h).w -
                                  kBeta.value(Footprint::psi, e, q - h).w) /
                                 (2 * h);
                EXPECT_NEAR(at.slope, d, 1e-9 + 5e-5 * std::abs(d)) << e << " at " << q;
            }
            const double d = (kBeta.value(Footprint::psi, e + k, q).w -
                              kBeta.value(Footprint::psi, e - k, q).w) /
                             (2 * k);
            EXPECT_NEAR(at.by_exponent, d, 1e-8) << e << " at " << q;
            if (q >= kR2) {
                EXPECT_EQ(at.w, 0);
                EXPECT_EQ(at.slope, 0);
                EXPECT_EQ(at.by_exponent, 0);
            }
        }
    EXPECT_EQ(kBeta.value(Footprint::psi, 4, 0).w, 1);
    EXPECT_EQ(kBeta.value(Footprint::psi, 4, 0).by_exponent, 0);
    for (const Footprint f : test::kFootprints)
        for (const double t : {-1.3, 0.0, 1.0, 2.5}) {
            const double d = (kBeta.exponent(f, t + 1e-6) - kBeta.exponent(f, t - 1e-6)) / 2e-6;
            EXPECT_NEAR(kBeta.exponent_slope(f, t), d, 1e-7);
        }
}

TEST(ShapedKernel, Exponent_isHeldBetweenItsBounds) {
    for (const Footprint f : test::kFootprints) {
        EXPECT_EQ(kBeta.exponent(f, -100), BETA_EXPONENT_LEAST);
        EXPECT_EQ(kBeta.exponent(f, 100), BETA_EXPONENT_MOST);
        EXPECT_EQ(kBeta.exponent_slope(f, -100), 0);
        EXPECT_EQ(kBeta.exponent_slope(f, 100), 0);
        // The rows of the tables reach from one bound to the other.
        EXPECT_EQ(kBeta.exponent(f, kBeta.shape_of_row(0)), BETA_EXPONENT_LEAST);
        EXPECT_EQ(kBeta.exponent(f, kBeta.shape_of_row(SHAPE_ROWS - 1)), BETA_EXPONENT_MOST);
    }
    EXPECT_DOUBLE_EQ(kBeta.exponent(Footprint::psi, beta_shape_of(7.25)), 7.25);
}

// Integrates (1 - r^2/R^2)^b numerically: the line integral at q over that at 0, and the moments in
// space and in the plane.
TEST(ShapedKernel, FootprintsAndMoments_areTheIntegrals) {
    for (const double b : {1.0, 2.7, 4.0, 30.0}) {
        const auto w = [&](double q) { return q < kR2 ? std::pow(1 - q / kR2, b) : 0; };
        const auto line = [&](double q) {
            return integral(std::sqrt(kR2 - q), [&](double z) { return w(q + z * z); });
        };
        for (const double q : {0.5, 3.0, 9.0, 12.5})
            EXPECT_NEAR(kBeta.value(Footprint::psi, b + 0.5, q).w, line(q) / line(0), 1e-6)
                << b << " at " << q;
        const double r = std::sqrt(kR2);
        const double psi = integral(r, [&](double x) { return std::pow(x, 4) * w(x * x); }) /
                           integral(r, [&](double x) { return x * x * w(x * x); }) / 3;
        EXPECT_NEAR(kBeta.covariance_scale(Footprint::psi, b), psi, 1e-6);
        const double plane = integral(kR2, [&](double q) { return q * w(q); }) /
                             integral(kR2, [&](double q) { return w(q); }) / 2;
        EXPECT_NEAR(kBeta.second_moment(Footprint::psi, b), psi * plane, 1e-6);
        // The exact footprint preserves the moment in space.
        EXPECT_NEAR(kBeta.second_moment(Footprint::exact, b + 0.5), psi, 1e-6);
    }
}

TEST(ShapedKernel, Reach_isWhereTheCutoffIs) {
    for (const double e : {1.0, 3.3, 64.0})
        for (const double opacity : {0.0039, 0.004, 0.05, 1.0}) {
            const double q = kBeta.reach(Footprint::psi, e, opacity, 1 / 255.0);
            if (opacity < 1 / 255.0)
                EXPECT_EQ(q, 0);
            else
                EXPECT_NEAR(opacity * kBeta.value(Footprint::psi, e, q).w, 1 / 255.0, 1e-12);
        }
}

}  // namespace
}  // namespace darb
