// SPDX-License-Identifier: MIT
// The kernel generalized_exponential: closed forms against differences and integrals, the bound of
// its slope at the centre, and the Gaussian that it starts at.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/relocation_table.h"
#include "engine/kernels/shaped_kernel.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {
namespace {

const ShapedKernel& kExponential = exponential_kernel();

double w_of(double t, double q) {
    return kExponential.value(Footprint::psi, t, q).w;
}

/// The integral of f over [0, to], with points close together at 0.
template <class F>
double integral_from_0(double to, const F& f, int steps = 200'000) {
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
        const double x = (i + 0.5) / steps;
        sum += 2 * x * f(to * x * x);
    }
    return sum * to / steps;
}

TEST(ShapedExponential, Start_isTheGaussian) {
    const double t = kExponential.exponent(Footprint::psi, 0);
    EXPECT_EQ(t, 2);
    for (double q = 0; q < 60; q += 0.37) {
        EXPECT_NEAR(w_of(t, q), std::exp(-q / 2), 1e-15) << q;
        EXPECT_NEAR(kExponential.value(Footprint::psi, t, q).slope, -std::exp(-q / 2) / 2, 1e-15)
            << q;
    }
    EXPECT_NEAR(kExponential.covariance_scale(Footprint::psi, t), 1, 1e-14);
    EXPECT_NEAR(kExponential.second_moment(Footprint::psi, t), 1, 1e-14);
    EXPECT_NEAR(kExponential.reach(Footprint::psi, t, 0.6, 1 / 255.0),
                -2 * std::log(1 / 255.0 / 0.6), 1e-12);
    EXPECT_NEAR(kExponential.relocation_scale(Footprint::psi, t, 0.7, 4),
                relocation_scale(KERNEL_GAUSSIAN, Footprint::psi, 0.7, 4), 1e-8);
    const auto own = kExponential.radius_quantiles(Footprint::psi, t, 50);
    for (int k = 0; k < 50; ++k)
        EXPECT_NEAR(own[static_cast<std::size_t>(k)],
                    kernel_radius_quantile(KERNEL_GAUSSIAN, (k + 0.5) / 50), 1e-4);
    const auto nearest = kExponential.gaussian(Footprint::psi, t, false);
    EXPECT_NEAR(nearest.covariance, 1, 1e-6);
    EXPECT_LT(nearest.error, 1e-4);
}

TEST(ShapedExponential, Derivatives_matchDifferencesFromCentreToFarAway) {
    for (const double t : {1.0, 1.3, 2.0, 4.0, 8.0})
        for (const double q : {0.0, 1e-9, 1e-5, 1e-3, 0.3, 1.0, 2.0, 7.0, 40.0}) {
            const ShapedValue at = kExponential.value(Footprint::psi, t, q);
            const double h = 1e-5 * (q + 1e-4), k = 1e-6;
            const double d =
                (w_of(t, q + h) - w_of(t, std::max(q - h, 0.0))) / (q + h - std::max(q - h, 0.0));
            EXPECT_NEAR(at.slope, d, 1e-8 + 1e-4 * std::abs(d)) << t << " at " << q;
            EXPECT_NEAR(at.by_exponent, (w_of(t + k, q) - w_of(t - k, q)) / (2 * k), 1e-8)
                << t << " at " << q;
        }
    for (const double t : {1.0, 3.7, 8.0}) {
        EXPECT_EQ(w_of(t, 0), 1);
        EXPECT_NEAR(kExponential.value(Footprint::psi, t, 0).by_exponent, 0, 1e-18);
        EXPECT_EQ(kExponential.value(Footprint::psi, t, 1e30).slope, 0);
    }
    for (const double s : {-0.6, 0.0, 0.5, 1.3}) {
        const double d = (kExponential.exponent(Footprint::psi, s + 1e-6) -
                          kExponential.exponent(Footprint::psi, s - 1e-6)) /
                         2e-6;
        EXPECT_NEAR(kExponential.exponent_slope(Footprint::psi, s), d, 1e-7);
    }
    for (const double t : {1.05, 1.5, 2.0, 5.0, 7.9}) {
        const auto half_log = [&](double x) {
            return std::log(kExponential.covariance_scale(Footprint::psi, x)) / 2;
        };
        EXPECT_NEAR(kExponential.length_slope(Footprint::psi, t),
                    (half_log(t + 1e-6) - half_log(t - 1e-6)) / 2e-6, 1e-7);
    }
}

TEST(ShapedExponential, Slope_isBoundedAtTheCentreAndWhatBoundsItIsSmall) {
    double largest = 0, farthest = 0;
    for (const double t : {1.0, 1.1, 1.5, 1.9})
        for (double d = 0; d < 30; d += 1e-3) {
            const ShapedValue at = kExponential.value(Footprint::psi, t, d * d);
            largest = std::max(largest, -at.slope);
            farthest = std::max(farthest, std::abs(at.w - std::exp(-std::pow(d, t) / 2)));
            EXPECT_LE(-at.slope * d, 0.305) << "the Gaussian's largest, of the gradient of a mean";
        }
    EXPECT_LE(largest, 8);
    EXPECT_LT(farthest, 0.016);
}

TEST(ShapedExponential, Exponent_isHeldBetweenItsBounds) {
    EXPECT_EQ(kExponential.exponent(Footprint::psi, -100), EXPONENTIAL_LEAST);
    EXPECT_EQ(kExponential.exponent(Footprint::psi, 100), EXPONENTIAL_MOST);
    EXPECT_EQ(kExponential.exponent_slope(Footprint::psi, -100), 0);
    EXPECT_EQ(kExponential.exponent_slope(Footprint::psi, 100), 0);
    EXPECT_NEAR(kExponential.exponent(Footprint::psi, kExponential.shape_of_row(0)),
                EXPONENTIAL_LEAST, 1e-12);
    EXPECT_NEAR(kExponential.exponent(Footprint::psi, kExponential.shape_of_row(SHAPE_ROWS - 1)),
                EXPONENTIAL_MOST, 1e-12);
}

TEST(ShapedExponential, Moments_areTheIntegrals) {
    for (const double t : {1.0, 1.4, 2.0, 3.5, 8.0}) {
        const double r = std::sqrt(std::pow(60, 2 / t));
        const auto space = [&](int power) {
            return integral_from_0(r,
                                   [&](double x) { return std::pow(x, power) * w_of(t, x * x); });
        };
        const double psi = space(4) / space(2) / 3;
        EXPECT_NEAR(kExponential.covariance_scale(Footprint::psi, t) / psi, 1, 2e-3) << t;
        EXPECT_NEAR(kExponential.second_moment(Footprint::psi, t) / (psi * space(3) / space(1) / 2),
                    1, 4e-3)
            << t;
        const auto quantiles = kExponential.radius_quantiles(Footprint::psi, t, 10);
        for (const std::size_t k : {0u, 4u, 9u}) {
            const double below = integral_from_0(
                quantiles[k], [&](double x) { return x * x * w_of(t, x * x); }, 20'000);
            EXPECT_NEAR(below / space(2), (static_cast<double>(k) + 0.5) / 10, 1e-4) << t;
        }
    }
}

TEST(ShapedExponential, Reach_isWhereTheCutoffIs) {
    for (const double t : {1.0, 2.0, 8.0})
        for (const double opacity : {0.0039, 0.004, 0.05, 1.0}) {
            const double q = kExponential.reach(Footprint::psi, t, opacity, 1 / 255.0);
            if (opacity < 1 / 255.0)
                EXPECT_EQ(q, 0);
            else
                EXPECT_NEAR(opacity * w_of(t, q), 1 / 255.0, 1e-12);
        }
}

TEST(ShapedExponential, ExactFootprint_isRefused) {
    EXPECT_FALSE(has_exact_footprint(KERNEL_GENERALIZED_EXPONENTIAL));
}

}  // namespace
}  // namespace darb
