// SPDX-License-Identifier: MIT
#include "engine/reference/adam.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"

namespace darb::reference {

template <class T>
void adam_step(std::span<T> parameter, std::span<const T> gradient, std::span<T> moment1,
               std::span<T> moment2, double learning_rate, int step, const AdamSettings& settings) {
    const size_t n = parameter.size();
    if (step < 1) throw Error("Adam", fmt::format("step {}", step), "Steps count from 1.");
    if (gradient.size() != n || moment1.size() != n || moment2.size() != n)
        throw Error("Adam",
                    fmt::format("{} parameters, {} gradients, moments {} and {}", n,
                                gradient.size(), moment1.size(), moment2.size()),
                    "All must have the same length.");
    const double bias1 = 1 - std::pow(settings.beta1, step);
    const double bias2 = 1 - std::pow(settings.beta2, step);
    for (size_t i = 0; i < n; ++i) {
        const double g = static_cast<double>(gradient[i]);
        const double m =
            settings.beta1 * static_cast<double>(moment1[i]) + (1 - settings.beta1) * g;
        const double v =
            settings.beta2 * static_cast<double>(moment2[i]) + (1 - settings.beta2) * g * g;
        moment1[i] = static_cast<T>(m);
        moment2[i] = static_cast<T>(v);
        const double move =
            learning_rate / bias1 * m / (std::sqrt(v) / std::sqrt(bias2) + settings.epsilon);
        parameter[i] = static_cast<T>(static_cast<double>(parameter[i]) - move);
    }
}

double decayed_learning_rate(double first, double last, int step, int steps) {
    const double share = steps > 0 ? std::clamp(double(step) / steps, 0.0, 1.0) : 1.0;
    return std::exp(std::log(first) * (1 - share) + std::log(last) * share);
}

template void adam_step(std::span<double>, std::span<const double>, std::span<double>,
                        std::span<double>, double, int, const AdamSettings&);
template void adam_step(std::span<float>, std::span<const float>, std::span<float>,
                        std::span<float>, double, int, const AdamSettings&);

}  // namespace darb::reference
