// SPDX-License-Identifier: MIT
// engine/kernels against vectors computed with 50 digits.
#include "tests/support/kernel_vectors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

namespace darb {
namespace {

using test::KernelVector;

class KernelVectors : public testing::Test {
  protected:
    void SetUp() override {
        auto loaded = test::load_kernel_vectors();
        if (!loaded)
            GTEST_SKIP() << "no reference vectors at " << test::kernel_vectors_path()
                         << "; set DARB_KERNEL_VECTORS";
        vectors_ = std::move(*loaded);
    }

    /// `of` is a function of q, which the file rounds to double. The last bit of q limits the
    /// accuracy where `of` is steep, or near a zero at the edge.
    template <typename OfQ>
    static void expect_close(const KernelVector& v, const char* what, double expected,
                             const OfQ& of, double relative) {
        const double q1 = std::nextafter(v.q, 0), q2 = std::nextafter(q1, 0);
        const double below = of(q1), above = of(std::nextafter(v.q, 1e300));
        // Where q lies on the edge itself, the function is zero on the other side. A kernel's own
        // jump there is not rounding, so the steepness inside counts, three times, because the last
        // step of a root is 2.4 times the one before.
        const bool beside_edge = below == 0 || above == 0;
        const double rounding_of_q =
            beside_edge ? 3 * std::abs(below - of(q2)) : std::abs(above - below);
        const double tolerance = 1e-15 + relative * std::abs(expected) + rounding_of_q;
        EXPECT_NEAR(expected, of(v.q), tolerance)
            << what << " of " << kernel_name(v.kernel) << " case " << v.index << " (" << v.tag
            << "), q = " << v.q;
    }

    std::vector<KernelVector> vectors_;
};

TEST_F(KernelVectors, EveryKernel_hasTheSameKindsOfCases) {
    std::vector<std::set<std::string>> kinds(KERNEL_COUNT);
    for (const KernelVector& v : vectors_) kinds[static_cast<std::size_t>(v.kernel)].insert(v.tag);
    EXPECT_GE(kinds[KERNEL_GAUSSIAN].size(), 5u);
    for (std::size_t kernel = 0; kernel < kinds.size(); ++kernel)
        EXPECT_EQ(kinds[kernel], kinds[KERNEL_GAUSSIAN]) << kernel_name(static_cast<int>(kernel));
}

TEST_F(KernelVectors, Value_agreesTo1e13) {
    for (const KernelVector& v : vectors_) {
        // Near the edge, the last bit of q limits w: |dw| = |slope| q 2^-53.
        const double w = kernel_value(v.kernel, Footprint::psi, v.q);
        EXPECT_NEAR(v.w, w, 1e-13 * v.w + 2e-16 * (1 + v.q * std::abs(v.slope)))
            << kernel_name(v.kernel) << " case " << v.index << " (" << v.tag << ")";
        EXPECT_NEAR(v.alpha, std::min(0.99, v.opacity * w), 1e-13);
    }
}

TEST_F(KernelVectors, Slope_agreesTo1e12) {
    for (const KernelVector& v : vectors_) {
        const auto slope = [&](double q) { return kernel_slope(v.kernel, Footprint::psi, q); };
        expect_close(v, "slope", v.slope, slope, 1e-12);
    }
}

TEST_F(KernelVectors, Slope_givesTheGradientsOfTheConic) {
    for (const KernelVector& v : vectors_) {
        const auto by_q = [&](double q) {
            return v.opacity * kernel_slope(v.kernel, Footprint::psi, q);
        };
        const auto times = [&](double factor) {
            return [by_q, factor](double q) { return by_q(q) * factor; };
        };
        const auto value = [&](double q) { return kernel_value(v.kernel, Footprint::psi, q); };
        const double g = by_q(v.q);
        const double to_dx = 2 * (v.a * v.dx + v.b * v.dy), to_dy = 2 * (v.b * v.dx + v.c * v.dy);
        // a dx and b dy cancel in needles; their rounding is relative to the larger of the two.
        const double slack = 4e-16 * std::abs(g);
        EXPECT_NEAR(v.d_dx, g * to_dx,
                    1e-11 * std::abs(v.d_dx) + slack * std::abs(2 * v.a * v.dx) + 1e-16);
        EXPECT_NEAR(v.d_dy, g * to_dy,
                    1e-11 * std::abs(v.d_dy) + slack * std::abs(2 * v.c * v.dy) + 1e-16);
        expect_close(v, "d_a", v.d_a, times(v.dx * v.dx), 1e-11);
        expect_close(v, "d_b", v.d_b, times(2 * v.dx * v.dy), 1e-11);
        expect_close(v, "d_c", v.d_c, times(v.dy * v.dy), 1e-11);
        expect_close(v, "d_opacity", v.d_opacity, value, 1e-13);
    }
}

}  // namespace
}  // namespace darb
