// SPDX-License-Identifier: MIT
// Adam (Kingma and Ba 2015) as PyTorch computes it, dense: every parameter moves every step.
#pragma once

#include <span>

namespace darb::reference {

struct AdamSettings {
    double beta1 = 0.9;
    double beta2 = 0.999;
    double epsilon = 1e-15;
};

/// One step on n parameters; all spans have length n. step counts from 1 over the whole run. With v
/// = 0 and a zero gradient, nothing moves.
template <class T>
void adam_step(std::span<T> parameter, std::span<const T> gradient, std::span<T> moment1,
               std::span<T> moment2, double learning_rate, int step,
               const AdamSettings& settings = {});

/// Log-linear decay from first to last over `steps`; step in [0, steps], constant afterwards.
double decayed_learning_rate(double first, double last, int step, int steps);

}  // namespace darb::reference
