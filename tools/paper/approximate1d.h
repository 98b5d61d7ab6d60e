// SPDX-License-Identifier: MIT
// The paper's one-dimensional study (its Figures 5 to 11): signals are approximated by sums of N
// kernels whose positions, widths and weights are fitted by Adam on the mean squared error.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shaders/shared/kernel_list.h"

namespace darb {

/// A signal on [-10, 10], within [-3, 3] if its support is bounded; its largest value is 1.
struct Signal1d {
    std::string_view name;
    double (*value)(double x);
};
/// square, triangle, gaussian, half_sinusoid, sharp_exponential, parabolic, trapezoid, and two that
/// are not symmetric: sawtooth, steps.
std::span<const Signal1d> signals_1d();

/// Kernels: any with an id except those of several pulses, with the profile of the psi footprint,
/// in the shaders' float32 arithmetic (fitted polynomials, exp2 by range reduction); and GES's
/// generalised exponential exp(-(q/2)^(b/2)), whose shape b is learned too, starting at the
/// Gaussian's 2.
constexpr int kGeneralisedExponential = -1;
/// The kernels of the family, followed by the generalised exponential.
std::vector<int> kernels_1d();
std::string_view kernel_1d_name(int kernel);

struct Fit1dOptions {
    int samples = 1000;  // on [-10, 10]
    int steps = 10'000;
    double learning_rate = 0.01;
};

/// A term: weight times w(((x - position) / width)^2).
struct Primitive1d {
    float position = 0, width = 1, weight = 0;
    float shape = 2;  // for the generalised exponential
};

struct Fit1d {
    std::vector<Primitive1d> primitives;
    double loss = 0;             // mean squared error at the end
    std::vector<double> losses;  // at curve_steps(options.steps)
    double seconds = 0;          // time of this thread
};

/// The steps at which losses are recorded: all up to 10, then about 40 per decade, and the last.
std::vector<int> curve_steps(int steps);

/// target: [samples]. The start depends only on primitives and seed, so that kernels start equally:
/// positions in [-3, 3], widths about 3/(1+N), weights 0.2 to 1. Widths and shapes are fitted as
/// logarithms, which keeps them positive.
Fit1d fit_1d(int kernel, std::span<const float> target, int primitives, std::uint64_t seed,
             const Fit1dOptions& options);

/// The loss, and its gradient by {position, log width, weight, log shape} of each primitive,
/// [N][4].
double loss_1d(int kernel, std::span<const float> target, std::span<const Primitive1d> primitives,
               std::vector<double>& gradient);

/// The sum of the terms at `samples` points of [-10, 10].
std::vector<float> evaluate_1d(int kernel, std::span<const Primitive1d> primitives, int samples);

/// The signal at `samples` points.
std::vector<float> sample_signal(const Signal1d& signal, int samples);

}  // namespace darb
