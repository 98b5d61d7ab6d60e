// SPDX-License-Identifier: MIT
// The correction factor: printed values, closed forms, and the paper's experiment.
#include "tools/paper/psi_report.h"

#include <gtest/gtest.h>

#include <cmath>

namespace darb {
namespace {

struct Row {
    int kernel;
    double exact, best, psi_l2, psi_linf, best_l2, best_linf, one_l2;
};

// exact: as the paper prints it, to 6 digits. The others: midpoint sums over 3,000 x 400 points.
constexpr Row kRows[] = {
    {KERNEL_RAISED_COSINE, 0.655153, 0.875524, 0.210, 0.127, 0.0153, 0.0095, 0.109},
    {KERNEL_HALF_COSINE_SQUARED, 1.363209, 0.750167, 0.7077, 0.4859, 0.161, 0.165, 0.351},
    {KERNEL_SINC, 1.176219, 0.846682, 0.2977, 0.1680, 0.0325, 0.037, 0.148},
    {KERNEL_INVERSE_QUADRATIC, 1.380018, 1.162751, 0.218, 0.133, 0.193, 0.114, 0.2099},
};

TEST(Psi, ExactAndLeastSquares_areThePrintedValuesToSixDigits) {
    for (const Row& row : kRows) {
        const DerivedKernel& kernel = derived_kernel(row.kernel);
        EXPECT_NEAR(kernel.psi(), row.exact, 5e-7) << kernel.row().name;
        EXPECT_NEAR(least_squares_psi(kernel), row.best, 2e-6) << kernel.row().name;
    }
}

TEST(Psi, FootprintDistances_areThoseOfTheQuadrature) {
    for (const Row& row : kRows) {
        const DerivedKernel& kernel = derived_kernel(row.kernel);
        const FootprintDistance psi = footprint_distance(kernel, kernel.psi());
        const FootprintDistance best = footprint_distance(kernel, row.best);
        EXPECT_NEAR(psi.l2, row.psi_l2, 6e-4) << kernel.row().name;
        EXPECT_NEAR(psi.linf, row.psi_linf, 6e-4) << kernel.row().name;
        EXPECT_NEAR(best.l2, row.best_l2, 6e-4) << kernel.row().name;
        EXPECT_NEAR(best.linf, row.best_linf, 6e-4) << kernel.row().name;
        EXPECT_NEAR(footprint_distance(kernel, 1).l2, row.one_l2, 6e-4) << kernel.row().name;
        const KernelCoefficients k = fit_coefficients(kernel, Footprint::exact, kFullDegree);
        EXPECT_LT(footprint_distance(kernel, k).linf, 1e-6) << kernel.row().name;
    }
}

TEST(Psi, Grid_agreesWithTheMomentsForEveryEntry) {
    const PsiGridOptions options{6, 48, 1};
    for (int k = 0; k < KERNEL_COUNT; ++k) {
        const DerivedKernel& kernel = derived_kernel(k);
        const auto grid = psi_on_grid(kernel, options);
        for (const PsiSpread& entry : grid) {
            EXPECT_NEAR(entry.median, kernel.psi(), 4e-3 * kernel.psi()) << kernel.row().name;
            EXPECT_LE(entry.low, entry.median);
            EXPECT_GE(entry.high, entry.median);
        }
    }
}

TEST(Rings, OnePulse_isTheKernelAndMoreCarryMost) {
    for (const int kernel : {KERNEL_RAISED_COSINE, KERNEL_SINC}) {
        EXPECT_EQ(rings_of(kernel, 1).psi, kernel_psi(kernel));
        EXPECT_NEAR(rings_of(kernel, 1).outside, 0, 1e-12);
        EXPECT_GT(rings_of(kernel, 2).psi, 3 * rings_of(kernel, 1).psi);
        EXPECT_GT(rings_of(kernel, 3).outside, rings_of(kernel, 2).outside);
        EXPECT_GT(rings_of(kernel, 2).outside, 0.5);
    }
    // Integral of r sin(pi r/3) over each pulse of 3: 9/pi, 27/pi in modulus, so 3/4 is outside.
    EXPECT_NEAR(rings_of(KERNEL_SINC, 2).outside, 0.75, 1e-12);
}

TEST(Psi, NewRow_hasAllThree) {
    // (1 - q/4)^3 projects to (1 - q/4)^3.5; its psi is 4/11.
    const DerivedKernel kernel({"triweight", 4, 3, KERNEL_FORM_COMPACT,
                                [](std::complex<double> q) { return std::pow(1.0 - q / 4.0, 3); }});
    const PsiResult r = measure_psi(kernel, {6, 48, 2});
    EXPECT_NEAR(r.exact, 4.0 / 11, 1e-12);
    for (const PsiSpread& entry : r.grid) EXPECT_NEAR(entry.median, 4.0 / 11, 1.5e-3);
    EXPECT_NEAR(projected_profile(kernel, 1.0), std::pow(0.75, 3.5), 1e-12);
    EXPECT_LT(r.by_best.l2, r.by_one.l2);
    EXPECT_LT(r.by_best.l2, r.by_psi.l2);
}

}  // namespace
}  // namespace darb
