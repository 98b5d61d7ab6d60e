// SPDX-License-Identifier: MIT
// Relocation factors and nearest Gaussians against printed figures, closed forms and brute force.
#include "engine/kernels/relocation_table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/kernels/kernel_profile.h"
#include "tests/support/footprints.h"
#include "tests/support/kernel_formulas.h"
#include "tests/support/tanh_sinh.h"

namespace darb {
namespace {

TEST(Relocation, Scale_isThePrintedFigure) {
    const auto scale = [](int k) { return relocation_scale(k, Footprint::psi, 0.9, 5); };
    EXPECT_NEAR(scale(KERNEL_GAUSSIAN), 0.797, 5e-4);
    EXPECT_NEAR(scale(KERNEL_RAISED_COSINE), 0.825, 5e-4);
    EXPECT_NEAR(scale(KERNEL_HALF_COSINE_SQUARED), 0.912, 5e-4);
    EXPECT_NEAR(scale(KERNEL_SINC), 0.836, 5e-4);
    EXPECT_NEAR(scale(KERNEL_INVERSE_QUADRATIC), 0.748, 5e-4);
}

TEST(Relocation, Gaussian_isTheBinomialSum) {
    // 3DGS-MCMC, eq. 9: o / sum_i C(N, i) (-1)^(i+1) o'^i / sqrt(i).
    for (const double opacity : {0.01, 0.4, 0.95})
        for (const int count : {2, 3, 8}) {
            const double part = relocation_opacity(opacity, count);
            double sum = 0, binomial = 1;
            for (int i = 1; i <= count; ++i) {
                binomial *= (count - i + 1.0) / i;
                sum += binomial * (i % 2 == 1 ? 1 : -1) * std::pow(part, i) / std::sqrt(i);
            }
            EXPECT_NEAR(relocation_scale(KERNEL_GAUSSIAN, Footprint::psi, opacity, count),
                        opacity / sum, 1e-12);
        }
}

TEST(Relocation, Scale_keepsTheIntegralOverALine) {
    for (int k = 0; k < KERNEL_COUNT; ++k)
        for (const Footprint f : test::kFootprints) {
            const double radius =
                std::isfinite(kernel_support(k)) ? std::sqrt(kernel_support(k)) : 9;
            const double part = relocation_opacity(0.8, 7);
            const double before = test::integrate(
                [&](double t) { return 0.8 * kernel_value(k, f, t * t); }, 0, radius);
            const double after = test::integrate(
                [&](double t) { return 1 - std::pow(1 - part * kernel_value(k, f, t * t), 7); }, 0,
                radius);
            EXPECT_NEAR(relocation_scale(k, f, 0.8, 7), before / after, 1e-10) << kernel_name(k);
        }
}

TEST(Relocation, Limits_areOne) {
    for (int k = 0; k < KERNEL_COUNT; ++k) {
        EXPECT_NEAR(relocation_scale(k, Footprint::psi, 0.7, 1), 1, 1e-13);
        EXPECT_EQ(relocation_scale(k, Footprint::psi, 0, 9), 1);
        EXPECT_NEAR(relocation_scale(k, Footprint::psi, 1e-9, 9), 1, 1e-8);
        EXPECT_LT(relocation_scale(k, Footprint::psi, 0.999, 50), 1);
        EXPECT_GT(relocation_scale(k, Footprint::psi, 0.999, 50), 0.1);
    }
    EXPECT_EQ(relocation_opacity(0, 4), 0);
    EXPECT_NEAR(relocation_opacity(0.75, 2), 0.5, 1e-15);
}

TEST(Relocation, Table_holdsTheScales) {
    const auto table = relocation_table(KERNEL_SINC, Footprint::psi, 8, 3);
    ASSERT_EQ(table.size(), 24U);
    EXPECT_EQ(table[2 * 8 + 5],
              static_cast<float>(relocation_scale(KERNEL_SINC, Footprint::psi, 5.5 / 8, 3)));
}

struct Printed {
    int kernel;
    double kept, error, freed, exact;  // covariance factors; relative L2 of the first
};

TEST(GaussianEquivalent, Covariance_isThePrintedFigure) {
    for (const Printed& p : {Printed{KERNEL_RAISED_COSINE, .9798, .103, .911, .858},
                             Printed{KERNEL_SINC, 1.941, .145, 1.767, 1.638},
                             Printed{KERNEL_HALF_COSINE_SQUARED, 3.014, .312, 2.417, 2.194},
                             Printed{KERNEL_INVERSE_QUADRATIC, 1.078, .249, 1.476, 1.454}}) {
        const double psi = kernel_psi(p.kernel);
        const auto kept = gaussian_equivalent(p.kernel, Footprint::psi, true);
        EXPECT_NEAR(kept.covariance / psi, p.kept, 6e-4) << kernel_name(p.kernel);
        EXPECT_NEAR(kept.error, p.error, 6e-4) << kernel_name(p.kernel);
        EXPECT_EQ(kept.opacity, 1);
        const auto freed = gaussian_equivalent(p.kernel, Footprint::psi, false);
        EXPECT_NEAR(freed.covariance / psi, p.freed, 6e-4) << kernel_name(p.kernel);
        EXPECT_LE(freed.error, kept.error);
        EXPECT_NEAR(gaussian_equivalent(p.kernel, Footprint::exact, true).covariance, p.exact, 6e-4)
            << kernel_name(p.kernel);
    }
}

TEST(GaussianEquivalent, Gaussian_isItself) {
    const auto g = gaussian_equivalent(KERNEL_GAUSSIAN, Footprint::psi, false);
    EXPECT_NEAR(g.covariance, 1, 1e-14);
    EXPECT_EQ(g.opacity, 1);
    EXPECT_EQ(g.error, 0);
}

TEST(GaussianEquivalent, Fit_isAMinimum) {
    for (int k = 1; k < KERNEL_COUNT; ++k)
        for (const bool keep : {true, false}) {
            const auto best = gaussian_equivalent(k, Footprint::psi, keep);
            const double c0 = best.covariance / kernel_psi(k);
            const auto distance = [&](double c, double a) {
                return test::integrate(
                    [&](double q) {
                        const double gap = test::formula(k, q) - a * std::exp(-q / (2 * c));
                        return gap * gap;
                    },
                    0, kernel_support(k));
            };
            // The tail beyond the support: a^2 c exp(-R^2/c).
            const auto all = [&](double c, double a) {
                return distance(c, a) + a * a * c * std::exp(-kernel_support(k) / c);
            };
            const double least = all(c0, best.opacity);
            EXPECT_LT(least, all(c0 * 1.01, best.opacity)) << kernel_name(k);
            EXPECT_LT(least, all(c0 / 1.01, best.opacity)) << kernel_name(k);
            if (keep) continue;
            EXPECT_LT(least, all(c0, best.opacity * 1.01)) << kernel_name(k);
            EXPECT_LT(least, all(c0, best.opacity / 1.01)) << kernel_name(k);
        }
}

}  // namespace
}  // namespace darb
