// SPDX-License-Identifier: MIT
// What `darb check` finds: one row per quantity, with its worst error and its tolerance.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/reference/comparison.h"

namespace darb::check {

struct Row {
    std::string group, name;
    double error = 0;    // at the value with the largest ratio of error to allowed error
    double allowed = 0;  // allowed error there: abs + rel |expected|
    size_t count = 0;    // values compared
    size_t outside = 0;  // values beyond their allowed error: a boundary band, which is limited
    size_t band = 0;     // how many values may be outside
    bool pass = false;
    std::string detail;  // why it failed; empty where it passed
    double seconds = 0;
    /// The error of the reference's own code run in float, by the same measure, where it was run.
    std::optional<double> float_alone;
};

/// Called with each row when it is ready.
using OnRow = std::function<void(const Row&)>;

/// scaled: the absolute tolerance, and the error in the row, are in units of the root mean
/// square of the expected values.
Row compare_row(const std::string& group, const std::string& name, std::span<const double> expected,
                std::span<const double> got, const reference::Tolerance& tolerance,
                bool scaled = false);
/// As above, for any container of numbers.
template <class Expected, class Got>
Row compare_row(const std::string& group, const std::string& name, const Expected& expected,
                const Got& got, const char* tolerance, bool scaled = false) {
    const std::vector<double> a(std::begin(expected), std::end(expected));
    const std::vector<double> b(std::begin(got), std::end(got));
    return compare_row(group, name, std::span(a), std::span(b), reference::tolerance(tolerance),
                       scaled);
}

/// A row that passes or fails as a whole; detail says what failed.
Row fact_row(const std::string& group, const std::string& name, bool holds,
             const std::string& detail);

}  // namespace darb::check
