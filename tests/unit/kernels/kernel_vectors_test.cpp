// engine/kernels against vectors computed with 50 digits.
#include "tests/support/kernel_vectors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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

    void expect_close(const KernelVector& v, const char* what, double expected, double got,
                      double relative) const {
        const double tolerance = 1e-15 + relative * std::abs(expected);
        EXPECT_NEAR(expected, got, tolerance) << what << " of " << kernel_name(v.kernel) << " case "
                                              << v.index << " (" << v.tag << "), q = " << v.q;
    }

    std::vector<KernelVector> vectors_;
};

TEST_F(KernelVectors, EveryKernel_hasAllKindsOfCases) {
    std::vector<int> count(KERNEL_COUNT);
    for (const KernelVector& v : vectors_) ++count[static_cast<std::size_t>(v.kernel)];
    for (const int n : count) EXPECT_EQ(n, 92);
}

TEST_F(KernelVectors, Value_agreesTo1e13) {
    for (const KernelVector& v : vectors_) {
        // Near the edge the last bit of q is what limits w: |dw| = |slope| q 2^-53.
        const double w = kernel_value(v.kernel, Footprint::psi, v.q);
        EXPECT_NEAR(v.w, w, 1e-13 * v.w + 2e-16 * (1 + v.q * std::abs(v.slope)))
            << kernel_name(v.kernel) << " case " << v.index << " (" << v.tag << ")";
        EXPECT_NEAR(v.alpha, std::min(0.99, v.opacity * w), 1e-13);
    }
}

TEST_F(KernelVectors, Slope_agreesTo1e12) {
    for (const KernelVector& v : vectors_)
        expect_close(v, "slope", v.slope, kernel_slope(v.kernel, Footprint::psi, v.q), 1e-12);
}

TEST_F(KernelVectors, Slope_givesTheGradientsOfTheConic) {
    for (const KernelVector& v : vectors_) {
        const double g = v.opacity * kernel_slope(v.kernel, Footprint::psi, v.q);
        const double to_dx = 2 * (v.a * v.dx + v.b * v.dy), to_dy = 2 * (v.b * v.dx + v.c * v.dy);
        // a dx and b dy cancel in needles; their rounding is relative to the larger of the two.
        const double slack = 4e-16 * std::abs(g);
        EXPECT_NEAR(v.d_dx, g * to_dx,
                    1e-11 * std::abs(v.d_dx) + slack * std::abs(2 * v.a * v.dx) + 1e-16);
        EXPECT_NEAR(v.d_dy, g * to_dy,
                    1e-11 * std::abs(v.d_dy) + slack * std::abs(2 * v.c * v.dy) + 1e-16);
        expect_close(v, "d_a", v.d_a, g * v.dx * v.dx, 1e-11);
        expect_close(v, "d_b", v.d_b, g * 2 * v.dx * v.dy, 1e-11);
        expect_close(v, "d_c", v.d_c, g * v.dy * v.dy, 1e-11);
        expect_close(v, "d_opacity", v.d_opacity, kernel_value(v.kernel, Footprint::psi, v.q),
                     2e-9);  // w near a zero at the edge, from a rounded q
    }
}

}  // namespace
}  // namespace darb
