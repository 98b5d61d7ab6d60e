// SPDX-License-Identifier: MIT
// Kernels with more than one pulse: raised cosine and the modulus of sinc with their rings.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_family.h"

namespace darb {
namespace {

struct Rings {
    int row, kernel, pulses;
    double radius;
};
constexpr Rings kRings[] = {{KERNEL_RAISED_COSINE_2_PULSES, KERNEL_RAISED_COSINE, 2, 7.5},
                            {KERNEL_RAISED_COSINE_3_PULSES, KERNEL_RAISED_COSINE, 3, 12.5},
                            {KERNEL_SINC_2_PULSES, KERNEL_SINC, 2, 6},
                            {KERNEL_SINC_3_PULSES, KERNEL_SINC, 3, 9}};

double ring_formula(const Rings& r, double q) {
    if (q >= r.radius * r.radius) return 0;
    const double d = std::sqrt(q);
    if (r.kernel == KERNEL_RAISED_COSINE) return 0.5 + 0.5 * std::cos(std::numbers::pi * d / 2.5);
    return d > 0 ? std::abs(std::sin(std::numbers::pi * d / 3) / (std::numbers::pi * d / 3)) : 1;
}

double value(int row, double q) {
    return kernel_value(row, Footprint::psi, q);
}

TEST(KernelPulses, Rows_areFoundByKernelAndCountAndByName) {
    for (const Rings& r : kRings) {
        EXPECT_EQ(kernel_with_pulses(r.kernel, r.pulses), r.row);
        EXPECT_EQ(kernel_with_pulses(r.row, 1), r.kernel);
        EXPECT_EQ(kernel_pulses(r.row), r.pulses);
        EXPECT_EQ(kernel_from_name(kernel_name(r.row)), r.row);
        EXPECT_FALSE(has_exact_footprint(r.row));
    }
    EXPECT_EQ(kernel_name(KERNEL_SINC_2_PULSES), "sinc_2_pulses");
    EXPECT_EQ(kernel_with_pulses(KERNEL_GAUSSIAN, 1), KERNEL_GAUSSIAN);
    EXPECT_FALSE(kernel_with_pulses(KERNEL_GAUSSIAN, 2));
    EXPECT_FALSE(kernel_with_pulses(KERNEL_SINC, 4));
    EXPECT_TRUE(has_exact_footprint(KERNEL_SINC));
}

TEST(KernelPulses, Value_isTheFormulaAndNeverNegative) {
    for (const Rings& r : kRings)
        for (double q = 0; q < 1.2 * r.radius * r.radius; q += 0.013) {
            EXPECT_NEAR(value(r.row, q), ring_formula(r, q), 1e-14)
                << kernel_name(r.row) << " " << q;
            EXPECT_GE(value(r.row, q), 0);
        }
}

TEST(KernelPulses, Slope_matchesCentralDifferences) {
    constexpr double kStep = 1e-4;
    for (const Rings& r : kRings)
        for (double q = 0.5; q < r.radius * r.radius - 1; q += 0.0237) {
            const double zero = r.kernel == KERNEL_SINC ? std::fmod(std::sqrt(q), 3) : 1;
            if (std::min(zero, 3 - zero) < 1e-3) continue;  // a kink
            const double difference =
                (value(r.row, q + kStep) - value(r.row, q - kStep)) / (2 * kStep);
            EXPECT_NEAR(kernel_slope(r.row, Footprint::psi, q), difference, 1e-8)
                << kernel_name(r.row) << " " << q;
        }
}

TEST(KernelPulses, Evaluation_isThatOfTheFamilyInDoubleAndInFloat) {
    for (const Rings& r : kRings) {
        const KernelCoefficients& k = kernel_coefficients(r.row, Footprint::psi, kFullDegree);
        for (double q = 0; q < 1.1 * r.radius * r.radius; q += 0.0171) {
            double w, slope;
            evaluate(k, q, w, slope);
            EXPECT_NEAR(w, value(r.row, q), 1e-12);
            EXPECT_NEAR(slope, kernel_slope(r.row, Footprint::psi, q), 1e-11)
                << kernel_name(r.row) << " " << q;
            float fw, fslope;
            evaluate(k, static_cast<float>(q), fw, fslope);
            EXPECT_NEAR(fw, w, 4e-6);
            if (w < 1 / 255.0) continue;  // about the kinks of |sinc|
            EXPECT_NEAR(fslope, slope, 4e-6) << kernel_name(r.row) << " " << q;
        }
    }
}

TEST(KernelPulses, Reach_isWhereTheOutermostVisiblePulseEnds) {
    constexpr double cutoff = 1 / 255.0;
    for (const Rings& r : kRings) {
        double nearest = 1e9, farthest = 0;
        for (const double opacity : {0.0041, 0.01, 0.017, 0.025, 0.05, 0.3, 1.0}) {
            const double reach = kernel_reach(r.row, Footprint::psi, opacity, cutoff);
            EXPECT_GE(opacity * value(r.row, reach * (1 - 1e-9)), cutoff) << opacity;
            for (double q = reach * (1 + 1e-9); q < r.radius * r.radius; q += 0.003)
                ASSERT_LT(opacity * value(r.row, q), cutoff)
                    << kernel_name(r.row) << " opacity " << opacity << ", q = " << q;
            nearest = std::min(nearest, reach);
            farthest = std::max(farthest, reach);
        }
        EXPECT_GT(farthest, std::pow(r.radius - 1, 2)) << "of the last pulse";
        // The rings of sinc are lower than its centre, those of the raised cosine as high.
        EXPECT_EQ(nearest < 9, r.kernel == KERNEL_SINC) << kernel_name(r.row);
    }
}

TEST(KernelPulses, CovarianceAndSplits_areThoseOfOnePulse) {
    for (const Rings& r : kRings) {
        EXPECT_NEAR(covariance_scale(r.row, Footprint::psi), kernel_psi(r.kernel), 1e-12);
        EXPECT_GT(kernel_psi(r.row), 3 * kernel_psi(r.kernel));
        EXPECT_NEAR(kernel_radius_quantile(r.row, 0.7), kernel_radius_quantile(r.kernel, 0.7),
                    1e-9);
    }
    // Integrals of r |sin| and r^3 |sin| over whole half waves: psi = 3/2 (n^2 + 1) - 18/pi^2.
    for (const int row : {KERNEL_SINC, KERNEL_SINC_2_PULSES, KERNEL_SINC_3_PULSES}) {
        const int n = kernel_pulses(row);
        EXPECT_NEAR(kernel_psi(row), 1.5 * (n * n + 1) - 18 / (std::numbers::pi * std::numbers::pi),
                    1e-10);
    }
}

}  // namespace
}  // namespace darb
