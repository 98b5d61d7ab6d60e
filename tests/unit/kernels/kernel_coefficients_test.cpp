// SPDX-License-Identifier: MIT
// The shader polynomials, evaluated in float32 on the CPU, against double.
#include "engine/kernels/kernel_coefficients.h"
#include "tests/support/footprints.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace darb {
namespace {

constexpr double kRounding = 3e-7;  // effect of float32 arithmetic on w
constexpr double kCutoff = 1 / 255.0;

double extent(const KernelCoefficients& k) {
    return std::isfinite(k.support) ? k.support : 40;
}

template <class Check>
void for_every_fit(Check check) {
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
        for (const Footprint footprint : test::kFootprints)
            for (int degree = kLeastDegree; degree <= kFullDegree; ++degree) {
                SCOPED_TRACE(std::string(kernel_name(kernel)) + " " +
                             std::string(footprint_name(footprint)) + " degree " +
                             std::to_string(degree));
                check(kernel, footprint, degree, kernel_coefficients(kernel, footprint, degree));
            }
}

TEST(KernelCoefficients, Value_inFloat_isWithinFitAndRounding) {
    for_every_fit([](int kernel, Footprint f, int, const KernelCoefficients& k) {
        double worst = 0, at = 0;
        for (int i = 0; i < 20000; ++i) {
            const float q = static_cast<float>(extent(k) * i / 20000);
            float w, slope;
            evaluate(k, q, w, slope);
            const double error = std::abs(w - kernel_value(kernel, f, q));
            if (error > worst) {
                worst = error;
                at = q;
            }
        }
        EXPECT_LE(worst, 1.1 * k.value_error + kRounding) << "q = " << at;
    });
}

TEST(KernelCoefficients, Slope_inFloat_isWithinFitAndRounding) {
    for_every_fit([](int kernel, Footprint f, int, const KernelCoefficients& k) {
        const double support = std::isfinite(k.support) ? k.support : 1;
        for (int i = 0; i < 5000; ++i) {
            const float q = static_cast<float>(extent(k) * i / 5000);
            float w, slope;
            evaluate(k, q, w, slope);
            const double truth = kernel_slope(kernel, f, q);
            // Slopes that grow without bound at the edge matter only above the cut-off.
            if (kernel_value(kernel, f, q) < kCutoff) continue;
            const double steep = k.line_integral ? std::max(1.0, std::sqrt(1e-3 / (1 - q / 9))) : 1;
            EXPECT_NEAR(slope * support, truth * support,
                        1.2 * k.slope_error * steep + 2e-6 * (1 + std::abs(truth) * support))
                << "q = " << q;
        }
    });
}

TEST(KernelCoefficients, FullDegree_isAtFloatRounding) {
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
        for (const Footprint f : test::kFootprints) {
            const KernelCoefficients& k = kernel_coefficients(kernel, f, kFullDegree);
            EXPECT_LT(k.value_error, 1.2e-7) << kernel_name(kernel) << " " << footprint_name(f);
        }
}

TEST(KernelCoefficients, HigherDegree_isNeverWorse) {
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
        for (const Footprint f : test::kFootprints)
            for (int degree = kLeastDegree; degree < kFullDegree; ++degree)
                EXPECT_LE(kernel_coefficients(kernel, f, degree + 1).value_error,
                          kernel_coefficients(kernel, f, degree).value_error + 1.2e-7)
                    << kernel_name(kernel) << " " << footprint_name(f) << " degree " << degree;
}

TEST(KernelCoefficients, Centre_isOne) {
    for_every_fit([](int, Footprint, int, const KernelCoefficients& k) {
        float w, slope;
        evaluate(k, 0.0f, w, slope);
        // The two line integrals with roots and quotients round a few times on the way to 1.
        EXPECT_NEAR(w, 1, k.form == KERNEL_FORM_QUADRIC ? 2.4e-7 : 0);
    });
}

TEST(KernelCoefficients, AtAndBeyondTheEdge_isExactlyZero) {
    for_every_fit([](int, Footprint, int, const KernelCoefficients& k) {
        if (!std::isfinite(k.support)) return;
        const float edge = static_cast<float>(k.support);
        for (const float q : {edge, std::nextafter(edge, 100.0f), edge * 1.0001f, 50.0f, 1e30f}) {
            float w, slope;
            evaluate(k, q, w, slope);
            EXPECT_EQ(w, 0) << "q = " << q;
            EXPECT_EQ(slope, 0) << "q = " << q;
        }
    });
}

TEST(KernelCoefficients, Value_fallsAndIsNeverNegative) {
    for_every_fit([](int, Footprint, int, const KernelCoefficients& k) {
        float previous = 2;
        for (int i = 0; i <= 5000; ++i) {
            float w, slope;
            evaluate(k, static_cast<float>(extent(k) * i / 5000), w, slope);
            ASSERT_GE(w, 0) << "step " << i;
            ASSERT_LE(w, previous + 2.4e-7f) << "step " << i;
            ASSERT_LE(slope, 1e-6f) << "step " << i;
            previous = w;
        }
    });
}

TEST(KernelCoefficients, Slope_isTheDerivativeOfTheComputedValue) {
    for_every_fit([](int, Footprint, int, const KernelCoefficients& k) {
        for (int i = 1; i < 97; ++i) {
            const double q = extent(k) * i / 100 * 0.9973, h = 1e-4;
            const auto at = [&](double s) {
                double w, slope;
                evaluate(k, q + s * h, w, slope);
                return w;
            };
            double w, slope;
            evaluate(k, q, w, slope);
            const double difference = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h);
            // The Gaussian's slope is -w/2 and not the derivative of its 2^f: their difference is
            // the fit's own error.
            const double slack = k.form == KERNEL_FORM_GAUSSIAN ? 40 * k.value_error * w : 0;
            EXPECT_NEAR(difference, slope, 1e-8 + slack) << "q = " << q;
        }
    });
}

TEST(KernelCoefficients, RaisedCosine_agreesWithThePublishedPolynomial) {
    const double c[] = {1, -.467401082, .0945535663, -.0111208516, 8.62064086e-4, -4.34294969e-5};
    const KernelCoefficients& k =
        kernel_coefficients(KERNEL_RAISED_COSINE, Footprint::psi, kFullDegree);
    for (double t = 0; t < 1; t += 0.01) {
        double w, slope, p = 0;
        evaluate(k, 6.25 * t, w, slope);
        for (int i = 5; i >= 0; --i) p = p * t + c[i];
        EXPECT_NEAR(w, (1 - t) * (1 - t) * p, 2e-7);
    }
}

TEST(KernelCoefficients, EvenKernels_useTheSquaredVariable) {
    const auto squared = [](int kernel) {
        return kernel_coefficients(kernel, Footprint::psi, kFullDegree).squared;
    };
    EXPECT_TRUE(squared(KERNEL_HALF_COSINE_SQUARED));
    EXPECT_FALSE(squared(KERNEL_SQUARED_RAISED_COSINE));
    EXPECT_FALSE(squared(KERNEL_RAISED_COSINE));
    EXPECT_FALSE(squared(KERNEL_SINC));
}

}  // namespace
}  // namespace darb
