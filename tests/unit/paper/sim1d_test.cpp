// SPDX-License-Identifier: MIT
// The one-dimensional study: profiles against double precision, gradients against differences, and
// fits whose answer is known.
#include "tools/paper/approximate1d.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "engine/core/error.h"
#include "engine/kernels/kernel_family.h"
#include "engine/kernels/kernel_registry.h"
#include "tools/paper/study1d.h"

namespace darb {
namespace {

double true_profile(int kernel, double q, double shape) {
    if (kernel == kGeneralisedExponential) return std::exp(-std::pow(q / 2, shape / 2));
    return kernel_value(kernel, Footprint::psi, q);
}

TEST(Sim1d, Sum_isTheProfileInFloat32) {
    std::vector<int> kernels = kernels_1d();  // and those beyond the list
    kernels.push_back(KERNEL_BETA);
    kernels.push_back(
        register_kernel("sim1d_own", 9, [](double q) { return (1 - q / 9) * (1 - q / 9); }));
    for (const int kernel : kernels) {
        const Primitive1d p{0.37f, 1.3f, 0.8f, 1.4f};
        const std::vector<float> y = evaluate_1d(kernel, std::vector{p}, 1000);
        for (int i = 0; i < 1000; ++i) {
            const double x = 20.0 * i / 999 - 10, z = (x - p.position) / p.width;
            if (std::abs(z * z - 9) < 1e-3) continue;  // the jump of kernels cut at 3
            EXPECT_NEAR(y[static_cast<std::size_t>(i)], 0.8 * true_profile(kernel, z * z, p.shape),
                        1e-6)
                << kernel_1d_name(kernel) << " x = " << x;
        }
    }
}

TEST(Sim1d, Gradient_isThatOfDifferences) {
    const std::vector<float> target = sample_signal(signals_1d()[1], 1000);
    for (const int kernel : kernels_1d()) {
        if (kernel == KERNEL_INVERSE_QUADRATIC || kernel == KERNEL_INVERSE_MULTIQUADRIC)
            continue;  // their jump moves from sample to sample
        const std::vector<Primitive1d> at{{-0.8f, 1.1f, 0.6f, 1.7f}, {1.3f, 0.7f, 0.5f, 2.5f}};
        std::vector<double> gradient, unused;
        loss_1d(kernel, target, at, gradient);
        for (std::size_t i = 0; i < 8; ++i) {
            const auto loss = [&](double step) {
                std::vector<Primitive1d> moved = at;
                Primitive1d& p = moved[i / 4];
                const float factor = static_cast<float>(std::exp(step));
                if (i % 4 == 0) p.position += static_cast<float>(step);
                if (i % 4 == 1) p.width *= factor;
                if (i % 4 == 2) p.weight += static_cast<float>(step);
                if (i % 4 == 3) p.shape *= factor;
                return loss_1d(kernel, target, moved, unused);
            };
            // Short, so that no sample crosses an edge, where kinked profiles have two slopes.
            const double step = 4e-4, slope = (loss(step) - loss(-step)) / (2 * step);
            EXPECT_NEAR(gradient[i], slope, 1e-4 + 0.01 * std::abs(slope))
                << kernel_1d_name(kernel) << " parameter " << i;
        }
    }
}

TEST(Sim1d, Fit_findsASignalOfItsOwnKernel) {
    const std::vector<Primitive1d> truth{{-0.4f, 1.6f, 0.9f}};
    for (const int kernel : {KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE, KERNEL_SINC}) {
        const std::vector<float> target = evaluate_1d(kernel, truth, 1000);
        const Fit1d fit = fit_1d(kernel, target, 1, 3, {1000, 3000, 0.01});
        EXPECT_LT(fit.loss, 1e-7) << kernel_1d_name(kernel);
        EXPECT_NEAR(fit.primitives[0].position, -0.4, 2e-3);
        EXPECT_NEAR(fit.primitives[0].width, 1.6, 5e-3);
        EXPECT_NEAR(fit.primitives[0].weight, 0.9, 2e-3);
        EXPECT_EQ(fit.losses.size(), curve_steps(3000).size());
    }
}

TEST(Sim1d, Shape_growsTowardsASquare) {
    const std::vector<float> target = sample_signal(signals_1d()[0], 1000);
    const Fit1d fit = fit_1d(kGeneralisedExponential, target, 1, 1, {1000, 3000, 0.01});
    EXPECT_GT(fit.primitives[0].shape, 4);
    EXPECT_LT(fit.loss, fit_1d(KERNEL_GAUSSIAN, target, 1, 1, {1000, 3000, 0.01}).loss);
}

TEST(Study1d, Result_repeatsOnAnyNumberOfThreadsAndCountsFailures) {
    Study1dOptions options;
    options.signals = {0, 7};
    options.kernels = {KERNEL_GAUSSIAN, KERNEL_PARABOLIC};
    options.primitives = {1, 3};
    options.seeds = 3;
    options.fit = {200, 300, 0.01};
    options.threads = 1;
    const auto none = [](std::size_t, std::size_t) {};
    const Study1dResult one = study_1d(options, none);
    options.threads = 3;
    const Study1dResult three = study_1d(options, none);
    ASSERT_EQ(one.rows.size(), 8u);
    for (std::size_t r = 0; r < one.rows.size(); ++r) {
        EXPECT_EQ(one.rows[r].median, three.rows[r].median);
        EXPECT_LE(one.rows[r].low, one.rows[r].median);
    }
    options.kernels = {KERNEL_RAISED_COSINE_2_PULSES};
    EXPECT_THROW(study_1d(options, none), Error);
    options.kernels = one.options.kernels;
    options.fit.steps = 1;  // nothing is learned in a step
    options.primitives = {1};
    options.signals = {0};
    options.fit.learning_rate = 50;  // and this one throws every kernel far away
    EXPECT_GT(study_1d(options, none).rows[0].failed, 0);
    EXPECT_NE(study_1d_report(one).page().find("sawtooth"), std::string::npos);
    EXPECT_NE(study_1d_table(one).find("parabolic"), std::string::npos);
}

TEST(Study1d, KernelWhoseEveryRunFailed_neverWinsAndItsRatioNamesTheSignals) {
    const double nan = std::nan("");
    Study1dResult result;
    result.options.signals = {0, 1};
    result.options.kernels = {KERNEL_GAUSSIAN, KERNEL_SINC};
    result.options.primitives = {1};
    result.options.seeds = 2;
    for (const auto& [signal, kernel, loss] : {std::tuple{0, KERNEL_GAUSSIAN, nan},
                                               {0, KERNEL_SINC, nan},
                                               {1, KERNEL_GAUSSIAN, 0.5},
                                               {1, KERNEL_SINC, 0.25}}) {
        Study1dRow row;
        row.signal = signal;
        row.kernel = kernel;
        row.primitives = 1;
        row.failed = std::isnan(loss) ? 2 : 0;
        row.median = loss;
        result.rows.push_back(row);
    }
    const std::string table = study_1d_table(result);
    EXPECT_EQ(table.find("-*"), std::string::npos) << table;
    EXPECT_NE(table.find("1.00/1 (0, 2)"), std::string::npos) << table;
    EXPECT_NE(table.find("0.50/1 (1, 2)"), std::string::npos) << table;
}

}  // namespace
}  // namespace darb
