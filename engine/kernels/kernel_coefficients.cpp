// SPDX-License-Identifier: MIT
#include "engine/kernels/kernel_coefficients.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "engine/core/error.h"

namespace darb {
namespace {

constexpr int kFitNodes = 64;
constexpr double kFullAccuracy = 1.2e-7;   // the spacing of float32 above 1
constexpr double kSlopeShare = 0.25;       // weight of a slope error relative to a value error
constexpr double kPlainSlopeShare = 0.01;  // that weight where the polynomial is the kernel
// Rounding that is left by terms that cancel must not make a device look wrong.
constexpr double kMostSumOfTerms = 100;

/// Chebyshev nodes of (from, to).
std::vector<double> nodes(double from, double to) {
    std::vector<double> x(kFitNodes);
    for (int j = 0; j < kFitNodes; ++j)
        x[static_cast<std::size_t>(j)] =
            from + (to - from) * (1 - std::cos(std::numbers::pi * (j + 0.5) / kFitNodes)) / 2;
    return x;
}

/// scale * {x^first, ..., x^degree}
std::vector<double> powers(double x, int first, int degree, double scale = 1) {
    std::vector<double> row;
    for (int k = first; k <= degree; ++k) row.push_back(scale * std::pow(x, k));
    return row;
}

/// Rounds coefficients to float, as the shaders store them, so that errors are measured with these.
void take(KernelCoefficients& k, int first, const std::vector<double>& c) {
    for (std::size_t i = 0; i < c.size(); ++i)
        k.c[static_cast<std::size_t>(first) + i] = static_cast<float>(c[i]);
}

/// u^a P(x), P = 1 + c1 x + ...: both w and dw/dx are fitted, the slope weakened where a < 1 makes
/// it infinite.
void fit_compact(const DerivedKernel& kernel, Footprint footprint, double slope_share,
                 KernelCoefficients& k) {
    const double a = 0.5 * k.half_power;
    LinearRows rows;
    for (const double x : nodes(0, 1)) {
        const double t = k.squared ? std::sqrt(x) : x, q = k.support * t, u = 1 - x;
        const double power = std::pow(u, a), lower = a > 0 ? a * std::pow(u, a - 1) : 0;
        rows.add(powers(x, 1, k.degree, power), kernel.value(footprint, q) - power);
        const double share = slope_share * (a < 1 ? std::pow(u, 1 - a) : 1);
        const double slope = kernel.slope(footprint, q) * k.support / (k.squared ? 2 * t : 1);
        std::vector<double> row;
        for (int i = 1; i <= k.degree; ++i)
            row.push_back(share * (power * i * std::pow(x, i - 1) - lower * std::pow(x, i)));
        rows.add(std::move(row), share * (slope + lower));
    }
    k.c[0] = 1;
    take(k, 1, minimax_fit(rows, {}));
}

/// 2^f on [-1/2, 1/2], relative error, with P(0) = 1 and P(1/2) = 2 P(-1/2): no jump from one
/// octave to the next, so that the computed value falls as q grows.
void fit_gaussian(KernelCoefficients& k) {
    LinearRows rows, exact;
    for (const double f : nodes(-0.5, 0.5)) {
        const double scale = std::exp2(-f);
        rows.add(powers(f, 1, k.degree, scale), 1 - scale);
    }
    std::vector<double> seam = powers(0.5, 1, k.degree);
    const std::vector<double> other = powers(-0.5, 1, k.degree, 2);
    for (std::size_t i = 0; i < seam.size(); ++i) seam[i] -= other[i];
    exact.add(std::move(seam), 1);
    k.c[0] = 1;
    take(k, 1, minimax_fit(rows, exact));
}

/// The exact footprints for evaluate_quadric, with value(0) = 1.
void fit_quadric(const DerivedKernel& kernel, KernelCoefficients& k) {
    const bool quadratic = k.half_power == 2;
    const double least = 1 / std::sqrt(1 + k.support);  // x at q = 0
    const auto argument = [&](double x) { return quadratic ? x : 1 / x - 2; };
    const auto factor = [&](double x) {
        const double u = 1 - ((1 + k.support) * x * x - 1) / k.support;
        return std::sqrt(quadratic ? u / (x * x) : u / (x * (1 + x)));
    };
    LinearRows rows, exact;
    for (const double x : nodes(least, 1)) {
        const double q = (1 + k.support) * x * x - 1;
        rows.add(powers(argument(x), 0, k.degree, factor(x)), kernel.value(Footprint::exact, q));
    }
    exact.add(powers(argument(least), 0, k.degree, factor(least)), 1);
    take(k, 0, minimax_fit(rows, exact));
}

/// Largest errors in double on points between the nodes, edge and centre included.
void measure(const DerivedKernel& kernel, Footprint footprint, KernelCoefficients& k) {
    constexpr int kSamples = 1000;
    const bool gaussian = !std::isfinite(k.support);
    const double end = gaussian ? 16 : k.support;
    KernelCoefficients drawn = k;  // for an exponential, so that only the error of 2^f is measured
    if (gaussian) drawn.form = KERNEL_FORM_GAUSSIAN;
    for (int i = 0; i < kSamples; ++i) {
        const double q = end * i / kSamples;
        double w, slope;
        evaluate(drawn, q, w, slope);
        k.least_value = std::min(k.least_value, w);
        const double truth = kernel.value(footprint, q);
        k.value_error = std::max(k.value_error, std::abs(w - truth) / (gaussian ? truth : 1));
        k.slope_error = std::max(k.slope_error, std::abs(slope - kernel.slope(footprint, q)) *
                                                    (gaussian ? 1 : k.support));
    }
}

KernelCoefficients fit_literal(const DerivedKernel& kernel, Footprint footprint, int degree,
                               bool squared, double slope_share = kSlopeShare) {
    const KernelProfile& row = kernel.row();
    KernelCoefficients k;
    k.form = row.form;
    k.degree = degree;
    k.support = row.support;
    if (std::isfinite(row.support)) {
        float inverse = static_cast<float>(1 / row.support);
        if (inverse * row.support < 1)
            inverse = std::nextafter(inverse, std::numeric_limits<float>::infinity());
        k.inverse_support = inverse;
    }
    if (row.form == KERNEL_FORM_COMPACT) {
        k.half_power = 2 * row.edge_order + (footprint == Footprint::exact ? 1 : 0);
        k.squared = squared;
        fit_compact(kernel, footprint, slope_share, k);
    } else if (row.form == KERNEL_FORM_EXPONENTIAL || row.form == KERNEL_FORM_GES) {
        fit_gaussian(k);
        k.exponent = EXPONENTIAL_START;  // GES_START, too
    } else if (row.form == KERNEL_FORM_GAUSSIAN || row.form == KERNEL_FORM_BETA) {
        fit_gaussian(k);
        k.exponent = row.edge_order + (footprint == Footprint::exact ? 0.5 : 0.0);
    } else if (row.form == KERNEL_FORM_RINGS) {
        k.degree = 0;
        k.modulus_of_sinc = row.kernel == KERNEL_SINC;
        for (std::size_t i = 0; i < kernel.pulses().size(); ++i) {
            k.c[2 * i] = kernel.pulses()[i].peak;
            k.c[2 * i + 1] = kernel.pulses()[i].end;
        }
    } else {
        // w(3) = 4^-e
        k.half_power = static_cast<int>(std::lround(-std::log2(kernel.value(Footprint::psi, 3))));
        k.line_integral = footprint == Footprint::exact;
        if (k.line_integral) fit_quadric(kernel, k);
    }
    measure(kernel, footprint, k);
    return k;
}

/// The better one of x = t and x = t^2; kernels of d^4 (cosines of q) gain two degrees from the
/// latter.
KernelCoefficients fit_degree(const DerivedKernel& kernel, Footprint footprint, int degree) {
    KernelCoefficients plain = fit_literal(kernel, footprint, degree, false);
    if (plain.form != KERNEL_FORM_COMPACT || footprint == Footprint::exact) return plain;
    const KernelCoefficients squared = fit_literal(kernel, footprint, degree, true);
    return squared.least_value >= 0 && squared.value_error < 0.5 * plain.value_error ? squared
                                                                                     : plain;
}

double sum_of_terms(const KernelCoefficients& k) {
    double sum = 0;
    for (const double c : k.c) sum += std::abs(c);
    return sum;
}

/// A negative w is allowed, because it is below every cut-off: see KernelProfile::given.
template <class Fit>
KernelCoefficients best_of_degrees(const Fit& fit) {
    KernelCoefficients best = fit(kLeastDegree);
    for (int degree = kLeastDegree + 1;
         degree <= KERNEL_MAX_DEGREE && best.value_error > kFullAccuracy; ++degree) {
        const KernelCoefficients k = fit(degree);
        if (k.value_error < best.value_error && sum_of_terms(k) <= kMostSumOfTerms) best = k;
    }
    return best;
}

KernelCoefficients fit_given(const DerivedKernel& kernel, Footprint footprint, int degree) {
    const auto fit = [&](int d) { return fit_degree(kernel, footprint, d); };
    if (degree == kFullDegree) return best_of_degrees(fit);
    KernelCoefficients k = fit(degree);
    while (k.value_error > kShortAccuracy && k.degree < KERNEL_MAX_DEGREE) k = fit(k.degree + 1);
    return k;
}

}  // namespace

KernelCoefficients fit_plain(const DerivedKernel& kernel, Footprint footprint) {
    return best_of_degrees([&](int degree) {
        return fit_literal(kernel, footprint, degree, false, kPlainSlopeShare);
    });
}

KernelCoefficients fit_coefficients(const DerivedKernel& kernel, Footprint footprint, int degree) {
    if (degree < kLeastDegree || degree > kFullDegree)
        throw Error("kernel", fmt::format("there is no polynomial of degree {}", degree),
                    fmt::format("Degrees are {} to {}.", kLeastDegree, kFullDegree));
    if (kernel.row().given && kernel.row().form == KERNEL_FORM_COMPACT)
        return fit_given(kernel, footprint, degree);
    const bool full = degree == kFullDegree;
    KernelCoefficients k = fit_degree(kernel, footprint, full ? kLeastDegree : degree);
    while (full && k.value_error > kFullAccuracy && k.degree < KERNEL_MAX_DEGREE)
        k = fit_degree(kernel, footprint, k.degree + 1);
    DARB_CHECK(k.least_value >= 0, "kernel {}, degree {}: w = {}", kernel.row().name, k.degree,
               k.least_value);
    return k;
}

const KernelCoefficients& kernel_coefficients(int kernel, Footprint footprint, int degree) {
    static std::mutex mutex;
    static std::map<std::tuple<int, Footprint, int>, KernelCoefficients> known;
    const std::scoped_lock lock(mutex);
    const auto key = std::tuple(kernel, footprint, degree);
    if (const auto found = known.find(key); found != known.end()) return found->second;
    return known[key] = fit_coefficients(derived_kernel(kernel), footprint, degree);
}

namespace {

constexpr int kIterations = 30;
using Matrix = std::vector<std::vector<long double>>;  // long double, because the normal equations
                                                       // square the condition number

std::vector<double> solve(Matrix m, std::vector<long double> b) {
    const std::size_t n = b.size();
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        for (std::size_t i = k + 1; i < n; ++i)
            if (std::abs(m[i][k]) > std::abs(m[pivot][k])) pivot = i;
        std::swap(m[k], m[pivot]);
        std::swap(b[k], b[pivot]);
        DARB_CHECK(m[k][k] != 0, "singular fit, column {} of {}", k, n);
        for (std::size_t i = k + 1; i < n; ++i) {
            const long double factor = m[i][k] / m[k][k];
            for (std::size_t j = k; j < n; ++j) m[i][j] -= factor * m[k][j];
            b[i] -= factor * b[k];
        }
    }
    std::vector<double> x(n);
    for (std::size_t k = n; k-- > 0;) {
        long double sum = b[k];
        for (std::size_t j = k + 1; j < n; ++j) sum -= m[k][j] * x[j];
        x[k] = static_cast<double>(sum / m[k][k]);
    }
    return x;
}

/// Least squares of the fitted rows with the exact rows as constraints (Lagrange multipliers).
std::vector<double> weighted_fit(const LinearRows& fitted, const std::vector<double>& weight,
                                 const LinearRows& exact) {
    const std::size_t unknowns = fitted.basis[0].size(), total = unknowns + exact.basis.size();
    Matrix m(total, std::vector<long double>(total, 0));
    std::vector<long double> b(total, 0);
    for (std::size_t i = 0; i < fitted.basis.size(); ++i)
        for (std::size_t j = 0; j < unknowns; ++j) {
            const long double scaled = static_cast<long double>(weight[i]) * fitted.basis[i][j];
            b[j] += scaled * fitted.target[i];
            for (std::size_t k = 0; k < unknowns; ++k) m[j][k] += scaled * fitted.basis[i][k];
        }
    for (std::size_t i = 0; i < exact.basis.size(); ++i) {
        for (std::size_t j = 0; j < unknowns; ++j)
            m[j][unknowns + i] = m[unknowns + i][j] = exact.basis[i][j];
        b[unknowns + i] = exact.target[i];
    }
    std::vector<double> x = solve(std::move(m), std::move(b));
    x.resize(unknowns);
    return x;
}

}  // namespace

std::vector<double> least_squares_fit(const LinearRows& fitted) {
    return weighted_fit(fitted, std::vector<double>(fitted.basis.size(), 1.0), {});
}

std::vector<double> minimax_fit(const LinearRows& fitted, const LinearRows& exact) {
    const std::size_t rows = fitted.basis.size();
    DARB_CHECK(rows > 0 && fitted.basis[0].size() > exact.basis.size(), "rows = {}", rows);
    std::vector<double> weight(rows, 1.0 / static_cast<double>(rows)), best, error(rows);
    double best_error = INFINITY;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
        const std::vector<double> c = weighted_fit(fitted, weight, exact);
        double largest = 0, total = 0;
        for (std::size_t i = 0; i < rows; ++i) {
            double sum = -fitted.target[i];
            for (std::size_t j = 0; j < c.size(); ++j) sum += fitted.basis[i][j] * c[j];
            error[i] = std::abs(sum);
            largest = std::max(largest, error[i]);
            total += weight[i] * error[i];
        }
        if (largest < best_error) {
            best_error = largest;
            best = c;
        }
        if (total < 1e-15) break;  // exact already: weights would vanish
        for (std::size_t i = 0; i < rows; ++i) weight[i] *= error[i] / total;
    }
    return best;
}

}  // namespace darb
