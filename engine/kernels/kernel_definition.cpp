// SPDX-License-Identifier: MIT
#include "engine/kernels/kernel_definition.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>

#include "engine/kernels/kernel_coefficients.h"

namespace darb {
namespace {

constexpr int kSeriesNodes = static_cast<int>(kMostSeriesTerms), kGrid = 2048;
constexpr double kRounding = 1e-9;  // rounding of an expression in double with cancellation
constexpr double kSameProfile = 1e-12;
constexpr double kZeroAtEdge = 1e-6;  // a smaller value of w / u^k at the edge counts as 0
// The largest error of the shaders' polynomial at which darb check can tell it from a device that
// computes wrongly: that of its fit in double plus that of its evaluation in float32.
constexpr double kFaithful = 4.8e-7;

std::string in_words(double number) {
    return std::isnan(number) ? "not a number" : fmt::format("{:.6g}", number);
}

double gaussian_profile(double q) {
    return std::exp(-q / 2);
}

/// The listed kernel that has this profile and a form of its own in the shaders.
int kernel_alike(double support, const std::function<double(double)>& w) {
    const auto same = [&](double (*profile)(double)) {
        const double end = std::isfinite(support) ? support : 60;
        for (int i = 1; i < kGrid; ++i) {
            const double q = end * i / kGrid;
            if (!(std::abs(w(q) - profile(q)) <= kSameProfile)) return false;
        }
        return true;
    };
    if (!std::isfinite(support)) return same(gaussian_profile) ? KERNEL_GAUSSIAN : -1;
    if (same([](double q) { return 1 / (1 + q); })) return KERNEL_INVERSE_QUADRATIC;
    if (same([](double q) { return 1 / std::sqrt(1 + q); })) return KERNEL_INVERSE_MULTIQUADRIC;
    return -1;
}

void check_support(double support) {
    if (!(support >= kLeastSupport && support <= kMostSupport))
        throw ProfileFault(fmt::format("a support of {}", support),
                           fmt::format("It is the q = d^2 where the kernel ends, {} to {}.",
                                       kLeastSupport, kMostSupport),
                           0);
}

/// Checks on a grid that w falls from 1.
void check_profile(double support, const std::function<double(double)>& w, double centre) {
    double before = 1;
    for (int i = 1; i < kGrid; ++i) {
        const double q = support * i / kGrid, value = w(q) / centre;
        if (!std::isfinite(value))
            throw ProfileFault(fmt::format("is {} at q = {}", in_words(value), in_words(q)),
                               "A kernel is finite up to its support.", q);
        if (value < -kRounding)
            throw ProfileFault(fmt::format("is negative, {:.3g}, at q = {}", value, in_words(q)),
                               "A kernel is not negative: give a smaller support, or abs().", q);
        if (value > before + kRounding)
            throw ProfileFault(fmt::format("grows, from {:.6g} to {:.6g}, before q = {}", before,
                                           value, in_words(q)),
                               "A kernel falls from its centre to its edge.", q);
        if (value < 1e-12 && i < kGrid - kGrid / 16)
            throw ProfileFault(fmt::format("is 0 from q = {} on", in_words(q)),
                               fmt::format("Give a support of {} or less.", in_words(q)), q);
        before = std::min(before, value);
    }
}

/// The series without the terms that are only rounding.
std::vector<double> series_of(const std::vector<double>& samples) {
    constexpr double kSeriesNoise = 2e-14;
    std::vector<double> series = ChebyshevSeries(samples).coefficients();
    while (series.size() > 1 && std::abs(series.back()) < kSeriesNoise) series.pop_back();
    return series;
}

std::vector<double> chebyshev_samples(const std::function<double(double)>& of_u, int nodes) {
    std::vector<double> samples;
    for (int j = 0; j < nodes; ++j)
        samples.push_back(of_u((1 + std::cos(std::numbers::pi * (j + 0.5) / nodes)) / 2));
    return samples;
}

/// p = u q + rest, p and q in T_k(2u - 1): u T_k = T_k / 2 + (T_k+1 + T_|k-1|) / 4.
double divide_by_u(const std::vector<double>& p, std::vector<double>& q) {
    const std::size_t n = p.size();
    q.assign(n + 1, 0.0);  // two zeros more than p has terms
    for (std::size_t j = n - 1; j >= 1; --j)
        q[j - 1] = (j == 1 ? 2 : 4) * (p[j] - q[j] / 2 - q[j + 1] / 4);
    const double rest = p[0] - q[0] / 2 - q[1] / 4;
    q.resize(std::max<std::size_t>(n - 1, 1));
    return rest;
}

/// Makes the series nearest to w in w itself. The division leaves rounding of the samples, and
/// remainders that it took for 0, where u^m is small.
void refine(KernelDefinition& d, const std::function<double(double)>& of_u) {
    constexpr std::size_t kMostRefinedTerms = 24;  // analytic profiles have about 10
    if (d.edge_order == 0 || d.series.size() > kMostRefinedTerms) return;
    LinearRows rows;
    for (int j = 0; j < kSeriesNodes; ++j) {
        const double x = std::cos(std::numbers::pi * (j + 0.5) / kSeriesNodes), u = (1 + x) / 2;
        std::vector<double> row;
        for (std::size_t k = 0; k < d.series.size(); ++k)
            row.push_back(std::pow(u, d.edge_order) *
                          std::cos(static_cast<double>(k) * std::acos(x)));
        rows.add(std::move(row), of_u(u));
    }
    d.series = least_squares_fit(rows);
}

/// Divides the series of w by u^m. Zeros of higher order stay in the series.
void divide_edge(KernelDefinition& d) {
    while (d.edge_order < kMostEdgeOrder && d.series.size() > 1) {
        std::vector<double> rest;
        if (std::abs(divide_by_u(d.series, rest)) > kZeroAtEdge) break;
        d.series = rest;
        ++d.edge_order;
    }
}

double value_of(const KernelProfile& row, double q) {
    return row.profile({q, 0}).real();
}

void normalise(KernelDefinition& d) {
    double centre, slope;
    ChebyshevSeries::of_coefficients(d.series).evaluate(1, centre, slope);
    for (double& c : d.series) c /= centre;
}

/// The largest distance of the series from w, and where it occurs.
std::pair<double, double> distance(const KernelDefinition& d,
                                   const std::function<double(double)>& w, double centre) {
    const KernelProfile row = profile_of(d);
    double largest = 0, at = 0;
    for (int i = 1; i < kGrid; ++i) {
        const double q = d.support * i / kGrid, error = std::abs(value_of(row, q) - w(q) / centre);
        if (!(error > largest)) continue;
        largest = error;
        at = q;
    }
    return {largest, at};
}

/// The polynomial that the shaders would use in place of the series.
void take_polynomial(KernelDefinition& d, const KernelCoefficients& k) {
    const auto p_of_u = [&k](double u) {
        double p, dp;
        evaluate_polynomial(k, 1 - u, p, dp);
        return p;
    };
    d.series = ChebyshevSeries(chebyshev_samples(p_of_u, k.degree + 1)).coefficients();
}

std::string name_by_digest(const KernelDefinition& d) {
    std::uint64_t hash = 1469598103934665603ull;  // FNV-1a
    const auto add = [&hash](double number) {
        const auto bits = std::bit_cast<std::uint64_t>(number);
        for (int byte = 0; byte < 8; ++byte)
            hash = (hash ^ (bits >> (8 * byte) & 255)) * 1099511628211ull;
    };
    add(d.support);
    add(d.like);
    add(d.edge_order);
    for (const double c : d.series) add(c);
    return fmt::format("kernel_{:08x}", static_cast<std::uint32_t>(hash ^ hash >> 32));
}

/// w at 0, or its limit where the formula has no value there.
double centre_of(double support, const std::function<double(double)>& w) {
    double centre = w(0);
    if (std::isnan(centre)) {  // 0/0
        const auto of_u = [&](double u) { return w(support * (1 - u)); };
        const std::vector<double> samples = chebyshev_samples(of_u, kSeriesNodes);
        if (std::ranges::all_of(samples, [](double s) { return std::isfinite(s); })) {
            double slope;
            ChebyshevSeries(samples).evaluate(1, centre, slope);
        }
    }
    if (!(std::isfinite(centre) && centre > 0))
        throw ProfileFault(fmt::format("is {} at its centre, q = 0", in_words(centre)),
                           "A kernel is 1 there; any other positive number is divided out.", 0);
    return centre;
}

void reduce(KernelDefinition& d, const std::function<double(double)>& w, double centre) {
    const auto of_u = [&](double u) { return w(d.support * (1 - u)) / centre; };
    d.series = series_of(chebyshev_samples(of_u, kSeriesNodes));
    divide_edge(d);
    refine(d, of_u);
    normalise(d);
    const DerivedKernel kernel(profile_of(d));
    const KernelCoefficients k = fit_coefficients(kernel, Footprint::psi, kFullDegree);
    const bool faithful = k.value_error <= kFaithful;
    const double series_error = distance(d, w, centre).first;
    if (!faithful || series_error > kFaithful) {
        KernelDefinition plain = d;
        take_polynomial(plain, fit_plain(kernel, Footprint::psi));
        normalise(plain);
        d.series = plain.series;
    }
    const auto [error, at] = distance(d, w, centre);
    d.error = error;
    if (!(error <= kWorstFit))
        throw ProfileFault(
            fmt::format(
                "is {:.2g} off what the shaders' polynomials reach at q = {}, {} is allowed", error,
                in_words(at), kWorstFit),
            "Use a smaller support, or a profile that is smooth in q: d = sqrt(q) has a cusp at 0.",
            at);
    if (error > kFaithful)
        d.notes.push_back(
            fmt::format("its nearest polynomial is drawn, {:.1e} off at most", error));
}

}  // namespace

bool KernelDefinition::same_kernel(const KernelDefinition& other) const {
    return name == other.name && support == other.support && like == other.like &&
           edge_order == other.edge_order && series == other.series;
}

std::string fault_of_kernel_name(std::string_view name) {
    const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
    if (name.empty() || name.size() > kMostNameLength || !letter(name.front()) ||
        !std::ranges::all_of(
            name, [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; }))
        return fmt::format(
            "is no name of a kernel: small letters, digits and _, a letter first, {} at most",
            kMostNameLength);
    for (const std::string_view word : {"all", "paper", "expr", "support", "name"})
        if (name == word) return "is a word of the lists of kernels";
    return {};
}

KernelProfile profile_of(const KernelDefinition& d) {
    KernelProfile row;
    row.name = d.name;
    row.support = d.support;
    row.edge_order = d.edge_order;
    row.given = true;
    row.kernel = d.like >= 0 ? d.like : KERNEL_PARABOLIC;  // which has no built-in formula, either
    if (d.like >= 0) {
        row.form = kernel_profile(d.like).form;
        row.profile = kernel_profile(d.like).profile;
        return row;
    }
    row.form = KERNEL_FORM_COMPACT;
    row.profile = [series = ChebyshevSeries::of_coefficients(d.series), support = d.support,
                   order = d.edge_order](std::complex<double> q) {
        const std::complex<double> u = (support - q) / support;
        std::complex<double> w = series.value(u);
        for (int i = 0; i < order; ++i) w *= u;
        return w;
    };
    return row;
}

void check_definition(const KernelDefinition& d) {
    if (const std::string fault = fault_of_kernel_name(d.name); !fault.empty())
        throw ProfileFault(fmt::format("'{}' {}", d.name, fault), "Choose another name.", 0);
    const bool listed = d.like == KERNEL_GAUSSIAN || d.like == KERNEL_INVERSE_QUADRATIC ||
                        d.like == KERNEL_INVERSE_MULTIQUADRIC;
    if (d.like >= 0 && (!listed || !d.series.empty() || d.edge_order != 0))
        throw ProfileFault("its profile is that of no kernel that has such a form",
                           "It is gaussian, inverse_quadratic or inverse_multiquadric.", 0);
    if (d.like == KERNEL_GAUSSIAN) {
        if (!std::isinf(d.support))
            throw ProfileFault("a Gaussian with a support", "Leave the support out.", 0);
        return;
    }
    check_support(d.support);
    if (d.like >= 0) return;
    if (d.edge_order < 0 || d.edge_order > kMostEdgeOrder)
        throw ProfileFault(fmt::format("an edge of order {}", d.edge_order),
                           fmt::format("Orders are 0 to {}.", kMostEdgeOrder), d.support);
    if (d.series.empty() || d.series.size() > kMostSeriesTerms)
        throw ProfileFault(fmt::format("a series of {} terms", d.series.size()),
                           fmt::format("Series have 1 to {}.", kMostSeriesTerms), 0);
    for (const double c : d.series)
        if (!(std::abs(c) <= 1e6))
            throw ProfileFault(fmt::format("a term {} in its series", c),
                               "Terms are numbers of 1e6 at most.", 0);
    const KernelProfile row = profile_of(d);
    double least = 1;
    for (int i = 0; i < kGrid; ++i) {
        const double q = d.support * i / kGrid, w = value_of(row, q);
        if (i == 0 ? !(std::abs(w - 1) <= kRounding) : !(w >= -kWorstFit && w <= least + kWorstFit))
            throw ProfileFault(fmt::format("its series is {:.6g} at q = {}", w, in_words(q)),
                               "A kernel is 1 at its centre and falls from there, never below 0.",
                               q);
        least = std::min(least, w);
    }
}

KernelDefinition define_kernel(std::string_view name, double support,
                               const std::function<double(double)>& w, std::string source) {
    KernelDefinition d;
    d.name = name;
    d.support = support;
    d.source = std::move(source);
    if (!name.empty())
        if (const std::string fault = fault_of_kernel_name(name); !fault.empty())
            throw ProfileFault(fmt::format("'{}' {}", name, fault), "Choose another name.", 0);
    if (!std::isinf(support)) check_support(support);
    const double centre = centre_of(std::isinf(support) ? 1 : support, w);
    if (std::abs(centre - 1) > kSameProfile)
        d.notes.push_back(fmt::format("w(0) is {:.6g}: divided by it", centre));
    d.like = kernel_alike(support, [&](double q) { return w(q) / centre; });
    if (std::isinf(support) && d.like < 0)
        throw ProfileFault("has no support, and is not exp(-q/2)",
                           "Give the q = d^2 where it ends, as ', support 9'.", 0);
    if (d.like < 0) {
        check_profile(support, w, centre);
        reduce(d, w, centre);
    }
    if (d.name.empty()) d.name = name_by_digest(d);
    check_definition(d);
    return d;
}

}  // namespace darb
