// SPDX-License-Identifier: MIT
#include "engine/kernels/quadrature.h"

#include <array>
#include <cmath>
#include <numbers>

namespace darb {
namespace {

constexpr int kPoints = 64;

std::array<QuadraturePoint, kPoints / 2> gauss_legendre() {
    std::array<QuadraturePoint, kPoints / 2> rule{};
    for (int i = 0; i < kPoints / 2; ++i) {
        // Newton from Tricomi's estimate of the i-th root of the Legendre polynomial.
        long double x = std::cos(std::numbers::pi_v<long double> * (i + 0.75L) / (kPoints + 0.5L));
        long double derivative = 0;
        for (int step = 0; step < 20; ++step) {
            long double previous = 1, current = x;
            for (int n = 2; n <= kPoints; ++n) {
                const long double next = ((2 * n - 1) * x * current - (n - 1) * previous) / n;
                previous = current;
                current = next;
            }
            derivative = kPoints * (previous - x * current) / (1 - x * x);
            x -= current / derivative;
        }
        const long double weight = 2 / ((1 - x * x) * derivative * derivative);
        rule[static_cast<std::size_t>(i)] = {static_cast<double>(x), static_cast<double>(weight)};
    }
    return rule;
}

}  // namespace

std::span<const QuadraturePoint> even_quadrature() {
    static const auto rule = gauss_legendre();
    return rule;
}

}  // namespace darb
