// SPDX-License-Identifier: MIT
// Every numerical check of a device and its driver against double: kernels, scan, sort, loss, the
// whole walk forward and back, and the hard cases.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/kernels/kernel_family.h"
#include "engine/raster/forward_options.h"
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

struct CheckOptions {
    // Runs walks and hard cases in all kernels and footprints, and the reference in float beside
    // them; takes minutes.
    bool every_kernel = false;
    // Checks values, walks and hard cases of this kernel alone, in its footprints.
    std::optional<int> kernel;
};

/// All rows, in order; each also goes to on_row when it is ready.
std::vector<Row> run_checks(Device& device, const CheckOptions& options, const OnRow& on_row);

// The parts of run_checks().

/// Checks all listed kernels, including those with several pulses, or just one.
std::vector<Row> check_kernels(Device& device, std::optional<int> kernel = std::nullopt);
std::vector<Row> check_scan_and_sort(Device& device);
std::vector<Row> check_loss(Device& device);
/// arithmetic: ARITHMETIC_* of the blends; fast16 has tolerances of its own.
std::vector<Row> check_walk(Device& device, int kernel, Footprint footprint, int evaluation,
                            bool float_alone = false, int arithmetic = ARITHMETIC_FLOAT32);

}  // namespace darb::check
