// SPDX-License-Identifier: MIT
// A kernel that the product does not have, added by one row: everything else must follow.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_profile.h"

namespace darb {
namespace {

/// (1 - q/4)^3, whose every quantity has a closed form.
const KernelProfile kTriweight{"triweight", 4, 3, KERNEL_FORM_COMPACT, [](std::complex<double> q) {
                                   const std::complex<double> u = 1.0 - q / 4.0;
                                   return u * u * u;
                               }};

/// exp(-q) cut at 2: a jump of 0.135, no zero at the edge.
const KernelProfile kCutGaussian{"cut_gaussian", 2, 0, KERNEL_FORM_COMPACT,
                                 [](std::complex<double> q) { return std::exp(-q); }};

TEST(NewKernel, Row_givesSlopePsiFootprintReachAndQuantile) {
    const DerivedKernel kernel(kTriweight);
    EXPECT_NEAR(kernel.psi(), 4.0 / 11, 1e-14);  // Beta(5/2,4) / Beta(3/2,4) R^2 / 3
    for (double q = 0; q < 4; q += 0.01) {
        const double u = 1 - q / 4;
        EXPECT_NEAR(kernel.slope(Footprint::psi, q), -0.75 * u * u, 1e-15);
        EXPECT_NEAR(kernel.value(Footprint::exact, q), std::pow(u, 3.5), 1e-14);
        EXPECT_NEAR(kernel.slope(Footprint::exact, q), -0.875 * std::pow(u, 2.5), 1e-12);
    }
    EXPECT_NEAR(kernel.reach(Footprint::psi, 0.8, 0.1), 4 * (1 - std::cbrt(0.125)), 1e-13);
    const double r = kernel.radius_quantile(0.5), t = r * r / 4;
    // Mass inside t: t^(3/2) (1/3 - 3t/5 + 3t^2/7 - t^3/9), in units of its value at 1.
    const auto mass = [](double x) {
        return std::pow(x, 1.5) * (1.0 / 3 - 3 * x / 5 + 3 * x * x / 7 - x * x * x / 9);
    };
    EXPECT_NEAR(mass(t) / mass(1), 0.5, 1e-12);
}

TEST(NewKernel, Row_givesShaderCoefficients) {
    for (const KernelProfile& row : {kTriweight, kCutGaussian}) {
        const DerivedKernel kernel(row);
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            const KernelCoefficients k = fit_coefficients(kernel, footprint, kFullDegree);
            for (double t = 0; t < 0.999; t += 0.001) {
                float w, slope;
                const float q = static_cast<float>(t * row.support);
                evaluate(k, q, w, slope);
                EXPECT_NEAR(w, kernel.value(footprint, q), 3e-7) << row.name << " t = " << t;
                EXPECT_NEAR(slope * row.support, kernel.slope(footprint, q) * row.support,
                            3e-6 / std::sqrt(1 - t))
                    << row.name << " t = " << t;
            }
            float w, slope;
            evaluate(k, static_cast<float>(row.support), w, slope);
            EXPECT_EQ(w, 0);
            EXPECT_EQ(slope, 0);
        }
    }
}

}  // namespace
}  // namespace darb
