// SPDX-License-Identifier: MIT
// The exact footprint: line integrals of the kernels.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "engine/kernels/kernel_family.h"
#include "tests/support/kernel_formulas.h"
#include "tests/support/tanh_sinh.h"

namespace darb {
namespace {

double line_integral(int kernel, double q) {
    const double support = std::isfinite(kernel_support(kernel)) ? kernel_support(kernel) : 200;
    return 2 * test::integrate([&](double z) { return test::formula(kernel, q + z * z); }, 0,
                               std::sqrt(support - q));
}

TEST(KernelFootprint, Exact_isTheLineIntegral) {
    for (int k = 0; k < KERNEL_COUNT; ++k) {
        const double extent = std::isfinite(kernel_support(k)) ? kernel_support(k) : 30;
        for (int i = 0; i < 100; ++i) {
            // Half of the points crowd towards the edge.
            const double q = i % 2 == 0 ? extent * i / 100 : extent * (1 - std::pow(0.8, i));
            // The reference rounds q + z^2 to the wrong side of the edge at times.
            EXPECT_NEAR(line_integral(k, q) / line_integral(k, 0),
                        kernel_value(k, Footprint::exact, q), i < 60 ? 1e-12 : 5e-12)
                << kernel_name(k) << " q = " << q;
        }
    }
}

TEST(KernelFootprint, InverseKernels_areTheClosedForms) {
    for (double q = 0; q < 8.999; q += 0.01) {
        const double s = std::sqrt((9 - q) / (1 + q)), v = 1 + q;
        EXPECT_NEAR(kernel_value(KERNEL_INVERSE_QUADRATIC, Footprint::exact, q),
                    std::atan(s) / (std::sqrt(v) * std::atan(3.0)), 1e-13);
        EXPECT_NEAR(kernel_slope(KERNEL_INVERSE_QUADRATIC, Footprint::exact, q),
                    -(1 / s + std::atan(s)) / (2 * std::pow(v, 1.5) * std::atan(3.0)), 1e-10);
        EXPECT_NEAR(kernel_value(KERNEL_INVERSE_MULTIQUADRIC, Footprint::exact, q),
                    std::asinh(s) / std::asinh(3.0), 1e-13);
    }
}

TEST(KernelFootprint, Parabola_becomesThePowerThreeHalves) {
    for (double q = 0; q < 9; q += 0.01)
        EXPECT_NEAR(kernel_value(KERNEL_PARABOLIC, Footprint::exact, q), std::pow(1 - q / 9, 1.5),
                    1e-14);
}

TEST(KernelFootprint, Gaussian_isItself) {
    for (double q = 0; q < 30; q += 0.1)
        EXPECT_EQ(kernel_value(KERNEL_GAUSSIAN, Footprint::exact, q),
                  kernel_value(KERNEL_GAUSSIAN, Footprint::psi, q));
}

/// u^(m + 1/2) P(u), coefficients in rising powers of u, against the series of engine/kernels.
void expect_printed(int kernel, int order, const std::vector<double>& c, double tolerance) {
    const double support = kernel_support(kernel);
    for (int i = 0; i <= 200; ++i) {
        const double u = i / 200.0;
        double p = 0;
        for (std::size_t k = c.size(); k-- > 0;) p = p * u + c[k];
        EXPECT_NEAR(kernel_value(kernel, Footprint::exact, support * (1 - u)),
                    std::pow(u, order + 0.5) * p, tolerance)
            << kernel_name(kernel) << " u = " << u;
    }
}

TEST(KernelFootprint, CompactKernels_agreeWithPublishedShortPolynomials) {
    expect_printed(KERNEL_RAISED_COSINE, 2,
                   {.657974325, .281977535, .053631936, .00589089515, .000525302076}, 8e-9);
    expect_printed(
        KERNEL_HALF_COSINE_SQUARED, 1,
        {1.34275793, -.000266354631, -.376921765, -.00510878612, .0455407854, -.00600167701},
        1.4e-7);
    expect_printed(KERNEL_SINC, 1, {.565463177, .339245044, .083018087, .0110723248, .00120134126},
                   3e-8);
}

}  // namespace
}  // namespace darb
