// SPDX-License-Identifier: MIT
#include "engine/kernels/kernel_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/kernels/kernel_expression.h"

namespace darb {
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
