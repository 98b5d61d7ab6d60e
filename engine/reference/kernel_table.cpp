// SPDX-License-Identifier: MIT
#include "engine/reference/kernel_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <tuple>

#include "engine/core/error.h"

namespace darb::reference {
namespace {

// The nearest singularity is that of the inverse quadratic, q = -1, at s = 1.054: with 64 pieces
// the Bernstein ellipse of the last piece has rho = 16, and 16^-12 = 4e-15.
constexpr int kPieces = 64;
constexpr int kPieceTerms = 12;

/// Monomial coefficients, in t in [-1, 1], of the interpolant through kPieceTerms Chebyshev nodes.
template <class Function>
std::array<double, kPieceTerms> fit_piece(const Function& f, double low, double high) {
    std::array<double, kPieceTerms> samples;
    std::array<double, kPieceTerms> chebyshev{};
    for (int i = 0; i < kPieceTerms; ++i) {
        const double angle = std::numbers::pi * (i + 0.5) / kPieceTerms;
        samples[i] = f(0.5 * (low + high) + 0.5 * (high - low) * std::cos(angle));
        for (int k = 0; k < kPieceTerms; ++k) {
            chebyshev[k] += (k == 0 ? 1.0 : 2.0) / kPieceTerms * samples[i] * std::cos(k * angle);
        }
    }
    // T_0 = 1, T_1 = t, T_{k+1} = 2 t T_k - T_{k-1}, as rows of monomials.
    std::array<double, kPieceTerms> previous{}, current{}, result{};
    previous[0] = 1;
    current[1] = 1;
    result[0] = chebyshev[0];
    for (int k = 1; k < kPieceTerms; ++k) {
        std::array<double, kPieceTerms> next{};
        for (int j = 0; j < kPieceTerms; ++j) {
            result[j] += chebyshev[k] * current[j];
            next[j] = (j > 0 ? 2 * current[j - 1] : 0.0) - previous[j];
        }
        previous = current;
        current = next;
    }
    return result;
}

template <class Function>
std::vector<double> fit(const Function& f) {
    std::vector<double> table;
    for (int piece = 0; piece < kPieces; ++piece) {
        const auto terms = fit_piece(f, double(piece) / kPieces, double(piece + 1) / kPieces);
        table.insert(table.end(), terms.begin(), terms.end());
    }
    return table;
}

}  // namespace

KernelTable::KernelTable(int kernel, Footprint footprint, int polynomial_degree)
    : kernel_(kernel),
      footprint_(footprint),
      in_place_(
          kernel_has_shape(kernel) || (polynomial_degree == 0 && has_exact_footprint(kernel))
              ? nullptr
              : &kernel_coefficients(kernel, footprint, std::max(polynomial_degree, kLeastDegree))),
      shaped_(kernel_has_shape(kernel) ? &shaped_kernel(kernel) : nullptr),
      exact_(footprint == Footprint::exact),
      support_(kernel_support(kernel)),
      covariance_scale_(darb::covariance_scale(kernel, footprint)) {
    if (!std::isfinite(support_) || in_place_ != nullptr || shaped_ != nullptr) {
        return;
    }
    const auto q_of = [this](double x) {
        return exact_ ? support_ * (1 - x) * (1 + x) : support_ * x;
    };
    value_table_ = fit([&](double x) { return kernel_value(kernel, footprint, q_of(x)); });
    slope_table_ = fit(
        [&](double x) { return (exact_ ? x : 1.0) * kernel_slope(kernel, footprint, q_of(x)); });
}

double KernelTable::evaluate(const std::vector<double>& table, double x) const {
    const double scaled = x * kPieces;
    const int piece = std::min(static_cast<int>(scaled), kPieces - 1);
    const double t = 2 * (scaled - piece) - 1;
    const double* terms = table.data() + piece * kPieceTerms;
    double sum = terms[kPieceTerms - 1];
    for (int k = kPieceTerms - 2; k >= 0; --k) {
        sum = sum * t + terms[k];
    }
    return sum;
}

double KernelTable::value(double q, double exponent) const {
    if (shaped_) return shaped_->value(footprint_, exponent, q).w;
    if (in_place_ != nullptr) {
        double w, slope;
        darb::evaluate(*in_place_, q, w, slope);
        return w;
    }
    if (value_table_.empty()) {
        return std::exp(-0.5 * q);
    }
    const double t = q / support_;
    return t < 1 ? evaluate(value_table_, exact_ ? std::sqrt(1 - t) : t) : 0.0;
}

double KernelTable::by_exponent(double q, double exponent) const {
    return shaped_ ? shaped_->value(footprint_, exponent, q).by_exponent : 0;
}

double KernelTable::covariance_scale(double exponent) const {
    return shaped_ ? shaped_->covariance_scale(footprint_, exponent) : covariance_scale_;
}

double KernelTable::slope(double q, double exponent) const {
    if (shaped_) return shaped_->value(footprint_, exponent, q).slope;
    if (in_place_ != nullptr) {
        double w, slope;
        darb::evaluate(*in_place_, q, w, slope);
        return slope;
    }
    if (slope_table_.empty()) {
        return -0.5 * std::exp(-0.5 * q);
    }
    const double t = q / support_;
    if (!(t < 1)) {
        return 0.0;
    }
    const double s = std::sqrt(1 - t);
    return exact_ ? evaluate(slope_table_, s) / s : evaluate(slope_table_, t);
}

double KernelTable::reach(double opacity, double cutoff, double exponent) const {
    if (shaped_) return shaped_->reach(footprint_, exponent, opacity, cutoff);
    if (!(opacity >= cutoff)) {
        return 0.0;
    }
    if (!std::isfinite(support_)) {
        // A short polynomial is off by up to a percent; blending tests every sample again.
        return -2 * std::log(cutoff / opacity) + (in_place_ != nullptr ? 0.05 : 0.0);
    }
    if (!has_exact_footprint(kernel_)) return kernel_reach(kernel_, footprint_, opacity, cutoff);
    double low = 0, high = support_;
    while (high - low > 1e-14 * support_) {
        const double middle = 0.5 * (low + high);
        (opacity * value(middle) < cutoff ? high : low) = middle;
    }
    return high;
}

const KernelTable& kernel_table(int kernel, Footprint footprint, int polynomial_degree) {
    static_cast<void>(kernel_profile(kernel));  // throws for ids that do not exist
    if (polynomial_degree < 0 || polynomial_degree > kFullDegree)
        throw Error("kernel", fmt::format("there is no polynomial of degree {}", polynomial_degree),
                    fmt::format("Use 0, for none, or a degree up to {}.", kFullDegree));
    struct Slot {
        std::once_flag once;
        std::unique_ptr<const KernelTable> table;
    };
    // A cache of constants: each entry is built once, and never moves or changes.
    static std::mutex growing;
    static std::map<std::tuple<int, Footprint, int>, Slot> slots;
    std::unique_lock lock(growing);
    Slot& slot = slots[{kernel, footprint, polynomial_degree}];
    lock.unlock();
    std::call_once(slot.once, [&] {
        slot.table = std::make_unique<const KernelTable>(kernel, footprint, polynomial_degree);
    });
    return *slot.table;
}

}  // namespace darb::reference
