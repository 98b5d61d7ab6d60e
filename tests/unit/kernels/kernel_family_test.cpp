// SPDX-License-Identifier: MIT
// The family against the printed formulas, closed forms and printed figures.
#include "engine/kernels/kernel_family.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/footprints.h"
#include "tests/support/kernel_formulas.h"
#include "tests/support/tanh_sinh.h"

namespace darb {
namespace {

using std::numbers::pi;
using test::integrate;

/// Where to look: the support, or as far as the Gaussian is above 1e-9.
double extent(int kernel) {
    return std::isfinite(kernel_support(kernel)) ? kernel_support(kernel) : 40;
}

TEST(KernelFamily, Names_roundTrip) {
    for (int k = 0; k < KERNEL_COUNT; ++k) EXPECT_EQ(kernel_from_name(kernel_name(k)), k);
    EXPECT_EQ(kernel_from_name("Gaussian"), std::nullopt);
    for (const Footprint f : test::kFootprints)
        EXPECT_EQ(footprint_from_name(footprint_name(f)), f);
    EXPECT_EQ(footprint_from_name(""), std::nullopt);
}

TEST(KernelFamily, Value_isThePrintedFormula) {
    for (int k = 0; k < KERNEL_COUNT; ++k) {
        EXPECT_EQ(kernel_support(k), test::formula_support(k));
        for (int i = 0; i <= 1000; ++i) {
            const double q = extent(k) * i / 900;  // goes past the edge
            EXPECT_NEAR(test::formula(k, q), kernel_value(k, Footprint::psi, q), 1e-15)
                << kernel_name(k) << " q = " << q;
        }
    }
}

TEST(KernelFamily, CentreAndEdge_areExact) {
    for (int k = 0; k < KERNEL_COUNT; ++k)
        for (const Footprint f : test::kFootprints) {
            EXPECT_NEAR(kernel_value(k, f, 0), 1, 1e-14) << kernel_name(k);
            if (!std::isfinite(kernel_support(k))) continue;
            EXPECT_EQ(kernel_value(k, f, kernel_support(k)), 0) << kernel_name(k);
            EXPECT_EQ(kernel_slope(k, f, kernel_support(k)), 0) << kernel_name(k);
            EXPECT_EQ(kernel_value(k, f, 1e6), 0) << kernel_name(k);
            EXPECT_GT(kernel_value(k, f, kernel_support(k) * (1 - 1e-12)), 0) << kernel_name(k);
        }
}

TEST(KernelFamily, Slope_atCentreAndEdge_isAsPrinted) {
    const auto centre = [](int k) { return kernel_slope(k, Footprint::psi, 0); };
    EXPECT_NEAR(centre(KERNEL_GAUSSIAN), -0.5, 1e-15);
    EXPECT_NEAR(centre(KERNEL_RAISED_COSINE), -pi * pi / 25, 1e-15);
    EXPECT_NEAR(centre(KERNEL_HALF_COSINE_SQUARED), 0, 1e-15);
    EXPECT_NEAR(centre(KERNEL_SINC), -pi * pi / 54, 1e-15);
    EXPECT_NEAR(centre(KERNEL_INVERSE_QUADRATIC), -1, 1e-15);
    const auto edge = [](int k) {
        return kernel_slope(k, Footprint::psi, kernel_support(k) * (1 - 1e-14));
    };
    EXPECT_NEAR(edge(KERNEL_RAISED_COSINE), 0, 1e-13);
    EXPECT_NEAR(edge(KERNEL_HALF_COSINE_SQUARED), -pi / 18, 1e-13);
    EXPECT_NEAR(edge(KERNEL_SINC), -1.0 / 18, 1e-13);
    EXPECT_NEAR(edge(KERNEL_INVERSE_QUADRATIC), -0.01, 1e-13);
}

TEST(KernelFamily, Slope_isTheDifferenceQuotient) {
    for (int k = 0; k < KERNEL_COUNT; ++k)
        for (const Footprint f : test::kFootprints)
            for (int i = 1; i < 95; ++i) {
                const double q = extent(k) * i / 100, h = 1e-5 * extent(k);
                // Five points: error h^4, and 1e-16 / h of rounding.
                const auto at = [&](double s) { return kernel_value(k, f, q + s * h); };
                const double difference = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h);
                EXPECT_NEAR(difference, kernel_slope(k, f, q), 1e-10)
                    << kernel_name(k) << " " << footprint_name(f) << " q = " << q;
            }
}

TEST(KernelFamily, FiveKernels_differPairwise) {
    for (int j = 0; j < KERNEL_COUNT; ++j)
        for (int k = 0; k < j; ++k)
            for (const Footprint f : test::kFootprints) {
                double difference = 0;
                for (double q = 0; q < 9; q += 0.1)
                    difference = std::max(difference,
                                          std::abs(kernel_value(j, f, q) - kernel_value(k, f, q)));
                EXPECT_GT(difference, 0.02) << kernel_name(j) << " and " << kernel_name(k);
            }
}

TEST(KernelFamily, EqualAreaScale_isTheClosedForm) {
    const double p2 = pi * pi;
    const auto expect = [](int k, double half_integral) {  // half_integral: of w dq, 1 for a
                                                           // Gaussian
        EXPECT_NEAR(equal_area_scale(k, Footprint::psi),
                    1 / std::sqrt(kernel_psi(k) * half_integral), 1e-13)
            << kernel_name(k);
    };
    expect(KERNEL_GAUSSIAN, 1);
    expect(KERNEL_RAISED_COSINE, 6.25 * (1.0 / 4 - 1 / p2));
    expect(KERNEL_HALF_COSINE_SQUARED, 9 / pi);
    expect(KERNEL_SINC, 18 / p2);
    expect(KERNEL_INVERSE_QUADRATIC, std::log(10) / 2);
    expect(KERNEL_PARABOLIC, 9.0 / 4);
    EXPECT_NEAR(equal_area_scale(KERNEL_RAISED_COSINE, Footprint::psi), 1.281634, 1e-6);
}

TEST(KernelFamily, EqualAreaScale_ofTheExactFootprintIsThatOfItsIntegral) {
    for (int k = 1; k < KERNEL_COUNT; ++k) {
        const double integral = integrate(
            [&](double q) { return kernel_value(k, Footprint::exact, q); }, 0, kernel_support(k));
        EXPECT_NEAR(equal_area_scale(k, Footprint::exact), std::sqrt(2 / integral), 1e-10)
            << kernel_name(k);
    }
}

TEST(KernelFamily, EqualAreaScale_leavesRingsOut) {
    for (const int k : {KERNEL_RAISED_COSINE, KERNEL_SINC})
        EXPECT_NEAR(equal_area_scale(*kernel_with_pulses(k, 3), Footprint::psi),
                    equal_area_scale(k, Footprint::psi), 1e-13);
}

TEST(KernelFamily, Psi_isThePrintedNumber) {
    EXPECT_NEAR(kernel_psi(KERNEL_RAISED_COSINE), 0.655153, 5e-7);
    EXPECT_NEAR(kernel_psi(KERNEL_HALF_COSINE_SQUARED), 1.363209, 5e-7);
    EXPECT_NEAR(kernel_psi(KERNEL_SINC), 1.176219, 5e-7);
    EXPECT_NEAR(kernel_psi(KERNEL_INVERSE_QUADRATIC), 1.380018, 5e-7);
}

TEST(KernelFamily, Psi_isTheClosedForm) {
    double c = 0, s = 0;  // the Fresnel integrals at 1
    for (int n = 20; n >= 0; --n) {
        const double even = std::pow(pi / 2, 2 * n) / std::tgamma(2 * n + 1.0) / (4 * n + 1);
        const double odd = std::pow(pi / 2, 2 * n + 1) / std::tgamma(2 * n + 2.0) / (4 * n + 3);
        c += n % 2 == 0 ? even : -even;
        s += n % 2 == 0 ? odd : -odd;
    }
    const double p2 = pi * pi, p4 = p2 * p2;
    EXPECT_NEAR(kernel_psi(KERNEL_GAUSSIAN), 1, 1e-14);
    EXPECT_NEAR(kernel_psi(KERNEL_RAISED_COSINE),
                6.25 / 3 * (1.0 / 5 - 4 / p2 + 24 / p4) / (1.0 / 3 - 2 / p2), 1e-13);
    EXPECT_NEAR(kernel_psi(KERNEL_HALF_COSINE_SQUARED), 3 * (1 / pi - 3 * c / p2) / ((1 - s) / pi),
                1e-13);
    EXPECT_NEAR(kernel_psi(KERNEL_SINC), 3 * (1 - 6 / p2), 1e-13);
    EXPECT_NEAR(kernel_psi(KERNEL_INVERSE_QUADRATIC),
                (6 + std::atan(3.0)) / (3 * (3 - std::atan(3.0))), 1e-13);
    EXPECT_NEAR(kernel_psi(KERNEL_PARABOLIC), 9.0 / 7, 1e-13);
}

TEST(KernelFamily, Psi_isTheRatioOfMoments) {
    for (int k = 0; k < KERNEL_COUNT; ++k) {
        const double radius = std::sqrt(std::isfinite(kernel_support(k)) ? kernel_support(k) : 200);
        const auto moment = [&](int power) {
            return integrate([&](double r) { return std::pow(r, power) * test::formula(k, r * r); },
                             0, radius);
        };
        EXPECT_NEAR(kernel_psi(k), moment(4) / moment(2) / 3, 1e-12) << kernel_name(k);
        EXPECT_EQ(covariance_scale(k, Footprint::psi), kernel_psi(k));
        EXPECT_EQ(covariance_scale(k, Footprint::exact), 1);
    }
}

TEST(KernelFamily, RadiusQuantile_invertsTheRadialMass) {
    for (int k = 0; k < KERNEL_COUNT; ++k) {
        const double end = std::sqrt(extent(k));
        const auto mass = [&](double radius) {
            return integrate([&](double r) { return r * r * test::formula(k, r * r); }, 0, radius);
        };
        double previous = -1;
        for (const double u : {0.0, 1e-6, 0.01, 0.25, 0.5, 0.9, 0.999}) {
            const double r = kernel_radius_quantile(k, u);
            EXPECT_GT(r, previous);
            EXPECT_LE(r, end);
            EXPECT_NEAR(mass(r) / mass(end), u, 2e-8 * u + 1e-12) << kernel_name(k) << " u = " << u;
            previous = r;
        }
    }
    EXPECT_NEAR(kernel_radius_quantile(KERNEL_GAUSSIAN, 0.5), 1.5381722544550522, 1e-12);  // chi_3
}

}  // namespace
}  // namespace darb
