// SPDX-License-Identifier: MIT
#include "tools/paper/approximate1d.h"

#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/kernels/kernel_family.h"
#include "tools/paper/sim1d_terms.h"

namespace darb {

namespace {

constexpr double kHalfWidth = 3;  // the signals are 6 wide
constexpr double kBeta1 = 0.9, kBeta2 = 0.999, kEpsilon = 1e-8;
constexpr int kParameters = 4;

double inside(double x, double value) {
    return std::abs(x) <= kHalfWidth ? value : 0;
}

constexpr Signal1d kSignals[] = {
    {"square", [](double x) { return inside(x, 1); }},
    {"triangle", [](double x) { return inside(x, 1 - std::abs(x) / kHalfWidth); }},
    {"gaussian", [](double x) { return std::exp(-0.5 * x * x); }},  // 6 standard deviations wide
    {"half_sinusoid",
     [](double x) { return inside(x, std::cos(std::numbers::pi * x / (2 * kHalfWidth))); }},
    {"sharp_exponential", [](double x) { return std::exp(-2 * std::abs(x)); }},
    {"parabolic", [](double x) { return inside(x, 1 - x * x / (kHalfWidth * kHalfWidth)); }},
    {"trapezoid",
     [](double x) { return inside(x, std::min(1.0, 2 * (1 - std::abs(x) / kHalfWidth))); }},
    {"sawtooth", [](double x) { return inside(x, (x + kHalfWidth) / (2 * kHalfWidth)); }},
    {"steps", [](double x) { return inside(x, x < -1  ? 0.3
                                              : x < 1 ? 1.0
                                                      : 0.6); }},
};

double thread_seconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::vector<Primitive1d> start_of(int primitives, std::uint64_t seed) {
    Pcg32 rng(seed, static_cast<std::uint64_t>(primitives));
    std::vector<Primitive1d> start(static_cast<std::size_t>(primitives));
    for (Primitive1d& p : start) {
        p.position = static_cast<float>(rng.uniform(-kHalfWidth, kHalfWidth));
        p.width = static_cast<float>(3.0 / (1 + primitives) * std::exp(rng.uniform(-0.3, 0.3)));
        p.weight = static_cast<float>(rng.uniform(0.2, 1));
    }
    return start;
}

/// Adam over {position, log width, weight, log shape}, in double.
class Adam1d {
  public:
    Adam1d(const std::vector<Primitive1d>& start, double learning_rate)
        : rate_(learning_rate), x_(start.size() * kParameters), m_(x_.size()), v_(x_.size()) {
        for (std::size_t i = 0; i < start.size(); ++i) {
            const Primitive1d& p = start[i];
            const double values[kParameters] = {p.position, std::log(p.width), p.weight,
                                                std::log(p.shape)};
            std::copy_n(values, kParameters, &x_[i * kParameters]);
        }
    }

    void step(const std::vector<double>& gradient) {
        power1_ *= kBeta1;
        power2_ *= kBeta2;
        for (std::size_t i = 0; i < x_.size(); ++i) {
            m_[i] = kBeta1 * m_[i] + (1 - kBeta1) * gradient[i];
            v_[i] = kBeta2 * v_[i] + (1 - kBeta2) * gradient[i] * gradient[i];
            x_[i] -=
                rate_ * (m_[i] / (1 - power1_)) / (std::sqrt(v_[i] / (1 - power2_)) + kEpsilon);
        }
    }

    void write(std::vector<Primitive1d>& primitives) const {
        for (std::size_t i = 0; i < primitives.size(); ++i) {
            const double* x = &x_[i * kParameters];
            primitives[i] = {static_cast<float>(x[0]), static_cast<float>(std::exp(x[1])),
                             static_cast<float>(x[2]), static_cast<float>(std::exp(x[3]))};
        }
    }

  private:
    double rate_, power1_ = 1, power2_ = 1;
    std::vector<double> x_, m_, v_;
};

}  // namespace

std::span<const Signal1d> signals_1d() {
    return kSignals;
}

std::vector<int> kernels_1d() {
    std::vector<int> kernels(KERNEL_COUNT);
    std::iota(kernels.begin(), kernels.end(), 0);
    kernels.push_back(kGeneralisedExponential);
    return kernels;
}

std::string_view kernel_1d_name(int kernel) {
    return kernel == kGeneralisedExponential ? "generalised_exponential" : kernel_name(kernel);
}

std::vector<int> curve_steps(int steps) {
    std::vector<int> all;
    for (double s = 0; s < steps; s = s < 10 ? s + 1 : std::ceil(s * 1.06)) all.push_back(int(s));
    all.push_back(steps);
    return all;
}

std::vector<float> sample_signal(const Signal1d& signal, int samples) {
    std::vector<float> values;
    for (const float x : sample_points_1d(samples))
        values.push_back(static_cast<float>(signal.value(x)));
    return values;
}

double loss_1d(int kernel, std::span<const float> target, std::span<const Primitive1d> primitives,
               std::vector<double>& gradient) {
    Terms1d terms(kernel, target, primitives.size());
    return terms.loss(primitives, gradient);
}

std::vector<float> evaluate_1d(int kernel, std::span<const Primitive1d> primitives, int samples) {
    const std::vector<float> zero(static_cast<std::size_t>(samples), 0.0f);
    Terms1d terms(kernel, zero, primitives.size());
    std::vector<double> gradient;
    terms.loss(primitives, gradient);
    return terms.residual();
}

Fit1d fit_1d(int kernel, std::span<const float> target, int primitives, std::uint64_t seed,
             const Fit1dOptions& options) {
    DARB_CHECK(primitives >= 1 && static_cast<int>(target.size()) == options.samples,
               "{} primitives, {} samples", primitives, target.size());
    Fit1d fit;
    fit.primitives = start_of(primitives, seed);
    const double start = thread_seconds();
    Terms1d terms(kernel, target, fit.primitives.size());
    Adam1d adam(fit.primitives, options.learning_rate);
    const std::vector<int> kept = curve_steps(options.steps);
    std::vector<double> gradient;
    for (int step = 0;; ++step) {
        fit.loss = terms.loss(fit.primitives, gradient);
        if (fit.losses.size() < kept.size() && step == kept[fit.losses.size()])
            fit.losses.push_back(fit.loss);
        if (step == options.steps || !std::isfinite(fit.loss)) break;
        adam.step(gradient);
        adam.write(fit.primitives);
    }
    fit.seconds = thread_seconds() - start;
    return fit;
}

}  // namespace darb
