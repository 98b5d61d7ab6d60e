// SPDX-License-Identifier: MIT
#include "engine/kernels/kernel_definition.h"

#include <fmt/format.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_expression.h"
#include "engine/kernels/kernel_family.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"

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

namespace {

int registered_with_notes(const KernelDefinition& definition, std::vector<std::string>& notes) {
    const int kernel = register_kernel(definition);
    for (const std::string& note : definition.notes)
        notes.push_back(fmt::format("kernel {}: {}", kernel_name(kernel), note));
    return kernel;
}

}  // namespace

int kernel_of_word(const std::string& option, const std::string& word,
                   std::vector<std::string>& notes) {
    if (is_kernel_expression(word))
        return registered_with_notes(kernel_from_expression(word, option), notes);
    const auto kernel = kernel_from_name(word);
    if (!kernel)
        throw Error(option + " " + word, "no such kernel",
                    "There are " + kernel_names() + ", and \"expr: (1 - q/9)^3, support 9\".");
    if (kernel_pulses(*kernel) > 1)
        throw Error(option + " " + word, "has more than one pulse",
                    fmt::format("Write {}: darb train and compare have --pulses, and darb psi "
                                "lists more pulses below its table.",
                                kernel_name(kernel_with_pulses(*kernel, 1).value())));
    return *kernel;
}

int kernel_of_option(const std::string& word, std::vector<std::string>& notes) {
    const std::vector<std::string> items = split_kernel_list(word);
    if (items.size() != 1)
        throw Error("--kernel " + word, fmt::format("names {} kernels", items.size()),
                    "One is wanted here.");
    return kernel_of_word("--kernel", items.front(), notes);
}

std::vector<int> kernels_of_file(const std::filesystem::path& path,
                                 std::vector<std::string>& notes) {
    std::vector<int> kernels;
    for (const KernelDefinition& definition : read_kernel_file(path)) try {
            kernels.push_back(registered_with_notes(definition, notes));
        } catch (const Error& e) {
            throw Error(path.string() + ": " + e.where, e.reason, e.hint);
        }
    return kernels;
}

std::string shaped_kernel_names() {
    std::string names;
    for (const int k : shaped_kernels()) names += std::string(kernel_name(k)) + ", ";
    return names + "blend:FIRST,SECOND";
}

std::string kernel_names() {
    std::string names;
    for (const int k : known_kernels()) names += std::string(kernel_name(k)) + ", ";
    return names + shaped_kernel_names();
}

namespace {

using Json = nlohmann::json;
using Rows = std::vector<std::pair<double, double>>;

constexpr std::size_t kMostFileBytes = std::size_t{1} << 22, kMostSourceLength = 2000;
constexpr const char* kFileHelp = "docs/kernels.md shows such files.";

void check_rows(const Rows& rows, const std::string& where) {
    const auto fail = [&](std::size_t row, const std::string& what, const std::string& hint) {
        return Error(where,
                     fmt::format("row {} of its table, q {:.6g}, w {:.6g}: {}", row + 1,
                                 rows[row].first, rows[row].second, what),
                     hint);
    };
    if (rows.size() < 3 || rows.size() > kMostTableRows)
        throw Error(where, fmt::format("a table of {} rows", rows.size()),
                    fmt::format("Tables have 3 to {}.", kMostTableRows));
    if (rows[0].first != 0) throw fail(0, "the first q is not 0", "Begin with [0, 1].");
    if (rows[0].second == 0) throw fail(0, "0 at the centre", "A kernel is 1 there.");
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const auto [q, w] = rows[i];
        if (!std::isfinite(q) || !std::isfinite(w))
            throw fail(i, "not finite", "A kernel is finite up to its support.");
        if (w < 0) throw fail(i, "negative", "A kernel is not negative.");
        if (i == 0) continue;
        if (!(q > rows[i - 1].first))
            throw fail(i, fmt::format("q does not rise, it is {:.6g} before", rows[i - 1].first),
                       "Sort the rows by q, and leave repeats out.");
        if (w > rows[i - 1].second)
            throw fail(i, fmt::format("w grows, it is {:.6g} before", rows[i - 1].second),
                       "A kernel falls from its centre to its edge.");
        if (w == 0 && i + 1 < rows.size())
            throw fail(i, "0 before the last row", "End the table there: that is the support.");
    }
}

/// Slopes of the cubics at the rows: weighted harmonic means, so that no piece grows.
std::vector<double> slopes_of(const Rows& rows) {
    const std::size_t last = rows.size() - 1;
    const auto step = [&](std::size_t i) { return rows[i + 1].first - rows[i].first; };
    const auto secant = [&](std::size_t i) {
        return (rows[i + 1].second - rows[i].second) / step(i);
    };
    std::vector<double> slope(rows.size());
    for (std::size_t i = 1; i < last; ++i) {
        const double a = secant(i - 1), b = secant(i);
        const double before = 2 * step(i) + step(i - 1), behind = step(i) + 2 * step(i - 1);
        if (a * b > 0) slope[i] = (before + behind) / (before / a + behind / b);
    }
    const auto at_end = [](double h, double next, double a,
                           double b) {  // slope of a parabola, limited
        const double s = ((2 * h + next) * a - h * b) / (h + next);
        return s * a <= 0 ? 0 : a * b <= 0 && std::abs(s) > 3 * std::abs(a) ? 3 * a : s;
    };
    slope[0] = at_end(step(0), step(1), secant(0), secant(1));
    slope[last] = at_end(step(last - 1), step(last - 2), secant(last - 1), secant(last - 2));
    return slope;
}

/// Slopes of the spline with these end slopes; nothing where some piece would grow.
std::optional<std::vector<double>> spline_slopes(const Rows& rows, std::vector<double> slope) {
    const std::size_t last = rows.size() - 1;
    const auto step = [&](std::size_t i) { return rows[i + 1].first - rows[i].first; };
    const auto secant = [&](std::size_t i) {
        return (rows[i + 1].second - rows[i].second) / step(i);
    };
    std::vector<double> above(rows.size());  // elimination of h1 s0 + 2 (h0 + h1) s1 + h0 s2
    for (std::size_t i = 1; i < last; ++i) {
        const double h0 = step(i - 1), h1 = step(i);
        const double right = 3 * (h1 * secant(i - 1) + h0 * secant(i));
        const double pivot = 2 * (h0 + h1) - h1 * above[i - 1];
        above[i] = h0 / pivot;
        slope[i] = (right - h1 * slope[i - 1]) / pivot;
    }
    for (std::size_t i = last - 1; i >= 1; --i) slope[i] -= above[i] * slope[i + 1];
    for (std::size_t i = 0; i < last; ++i) {
        const double a = slope[i], b = slope[i + 1], limit = 3 * secant(i);
        if (a > 0 || b > 0 || a * a + b * b > limit * limit) return std::nullopt;
    }
    return slope;
}

double cubic_at(const Rows& rows, const std::vector<double>& slope, double q) {
    const auto above = std::ranges::upper_bound(rows, q, {}, &Rows::value_type::first);
    const auto i = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
        above - rows.begin() - 1, 0, static_cast<std::ptrdiff_t>(rows.size()) - 2));
    const double h = rows[i + 1].first - rows[i].first, t = (q - rows[i].first) / h;
    const double s = 1 - t;
    return s * s * ((1 + 2 * t) * rows[i].second + t * h * slope[i]) +
           t * t * ((1 + 2 * s) * rows[i + 1].second - s * h * slope[i + 1]);
}

double number_of(const Json& json, const std::string& what, const std::string& where) {
    if (!json.is_number())
        throw Error(where, fmt::format("{} is no number: {}", what, json.dump().substr(0, 40)),
                    kFileHelp);
    return json.get<double>();
}

std::string text_of(const Json& json, const char* key, const std::string& where) {
    const auto at = json.find(key);
    if (at == json.end()) return {};
    if (!at->is_string()) throw Error(where, fmt::format("'{}' is no text", key), kFileHelp);
    return at->get<std::string>();
}

double support_of(const Json& json, const std::string& where) {
    const auto at = json.find("support");
    if (at == json.end() || at->is_null()) return std::numeric_limits<double>::infinity();
    return number_of(*at, "'support'", where);
}

Rows rows_of(const Json& table, const std::string& where) {
    if (!table.is_array()) throw Error(where, "'table' is no list", kFileHelp);
    Rows rows;
    for (const Json& row : table) {
        if (rows.size() == kMostTableRows)
            throw Error(where, fmt::format("a table of {} rows", table.size()),
                        fmt::format("Tables have 3 to {}.", kMostTableRows));
        const std::string name = fmt::format("row {} of its table", rows.size() + 1);
        if (!row.is_array() || row.size() != 2)
            throw Error(where, name + " is no pair [q, w]", kFileHelp);
        rows.emplace_back(number_of(row[0], name + ", q", where),
                          number_of(row[1], name + ", w", where));
    }
    return rows;
}

KernelDefinition function_of(const Json& f, const std::string& name, const std::string& where) {
    if (!f.is_object()) throw Error(where, "'function' is no object", kFileHelp);
    KernelDefinition d;
    d.name = name;
    d.support = support_of(f, where);
    d.source = text_of(f, "source", where).substr(0, kMostSourceLength);
    if (f.contains("error")) d.error = number_of(f["error"], "'error'", where);
    if (const std::string like = text_of(f, "like", where); !like.empty()) {
        const std::optional<int> kernel = kernel_from_name(like);
        if (!kernel) throw Error(where, "'like' names no kernel of the family", kFileHelp);
        d.like = *kernel;
    }
    if (f.contains("edge_order")) {
        const double order = number_of(f["edge_order"], "'edge_order'", where);
        d.edge_order = order >= 0 && order <= 99 ? static_cast<int>(order) : -1;
    }
    if (const auto series = f.find("series"); series != f.end()) {
        if (!series->is_array() || series->size() > kMostSeriesTerms)
            throw Error(where,
                        fmt::format("'series' is no list of {} numbers at most", kMostSeriesTerms),
                        kFileHelp);
        for (const Json& c : *series) d.series.push_back(number_of(c, "a term of 'series'", where));
    }
    try {
        check_definition(d);
    } catch (const Error& e) {
        throw Error(where, e.reason, e.hint);
    }
    return d;
}

KernelDefinition one_of(const Json& json, const std::string& stem, const std::string& where) {
    if (!json.is_object()) throw Error(where, "a kernel is no object {...}", kFileHelp);
    for (const auto& item : json.items())
        if (item.key() != "name" && item.key() != "support" && item.key() != "expression" &&
            item.key() != "table" && item.key() != "function")
            throw Error(where, fmt::format("'{}' is nothing that a kernel has", item.key()),
                        kFileHelp);
    std::string name = text_of(json, "name", where);
    if (name.empty() && fault_of_kernel_name(stem).empty() && !kernel_from_name(stem)) name = stem;
    if (const std::string fault = fault_of_kernel_name(name); !name.empty() && !fault.empty())
        throw Error(where, fmt::format("'{}' {}", name, fault), "Choose another name.");
    const int given = static_cast<int>(json.contains("expression") + json.contains("table") +
                                       json.contains("function"));
    if (given != 1)
        throw Error(where, given == 0 ? "has no profile" : "has more than one profile",
                    "Give an 'expression' or a 'table'.");
    if (json.contains("function")) return function_of(json["function"], name, where);
    if (json.contains("expression"))
        return kernel_from_expression(text_of(json, "expression", where), support_of(json, where),
                                      name, where);
    const Rows rows = rows_of(json["table"], where);
    if (json.contains("support") && !rows.empty() && support_of(json, where) != rows.back().first)
        throw Error(
            where,
            fmt::format("its support is not the last q of its table, {:.6g}", rows.back().first),
            "Leave the support out.");
    return kernel_from_table(name, rows, where);
}

}  // namespace

KernelDefinition kernel_from_table(std::string_view name, const Rows& rows,
                                   const std::string& where) {
    check_rows(rows, where);
    const std::vector<double> falling = slopes_of(rows);
    const std::vector<double> slope = spline_slopes(rows, falling).value_or(falling);
    try {
        return define_kernel(
            name, rows.back().first, [&](double q) { return cubic_at(rows, slope, q); },
            fmt::format("a table of {} rows", rows.size()));
    } catch (const ProfileFault& fault) {
        const auto row = std::ranges::lower_bound(rows, fault.q, {}, &Rows::value_type::first);
        throw Error(where,
                    fmt::format("its table, near row {}: {}",
                                std::min<std::ptrdiff_t>(row - rows.begin() + 1,
                                                         static_cast<std::ptrdiff_t>(rows.size())),
                                fault.reason),
                    fault.hint);
    }
}

std::vector<KernelDefinition> parse_kernel_file(std::string_view text, const std::string& where) {
    const Json json = parse_json_text(text, where, kFileHelp);
    const std::string stem = std::filesystem::path(where).stem().string();
    if (!json.is_array()) return {one_of(json, stem, where)};
    if (json.empty() || json.size() > kMostKernelsOfFile)
        throw Error(where, fmt::format("holds {} kernels", json.size()),
                    fmt::format("Files hold 1 to {}.", kMostKernelsOfFile));
    std::vector<KernelDefinition> kernels;
    for (const Json& one : json)
        kernels.push_back(one_of(one, "", fmt::format("{}, kernel {}", where, kernels.size() + 1)));
    return kernels;
}

std::vector<KernelDefinition> read_kernel_file(const std::filesystem::path& path) {
    const std::vector<std::byte> bytes = read_file_head(path, kMostFileBytes + 1);
    if (bytes.size() > kMostFileBytes)
        throw Error(path.string(), fmt::format("is larger than {} bytes", kMostFileBytes),
                    "A kernel needs some hundred.");
    return parse_kernel_file({reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                             path.string());
}

Json definition_json(const KernelDefinition& d) {
    Json f{{"source", d.source}, {"error", d.error}};
    if (std::isfinite(d.support)) f["support"] = d.support;
    if (d.like >= 0) {
        f["like"] = kernel_name(d.like);
    } else {
        f["edge_order"] = d.edge_order;
        f["series"] = d.series;
    }
    return {{"name", d.name}, {"function", f}};
}

KernelDefinition definition_from_json(const Json& json, const std::string& where) {
    return one_of(json, "", where);
}

}  // namespace darb
