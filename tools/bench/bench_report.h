// SPDX-License-Identifier: MIT
// Results of `darb bench` as lines on a terminal and as JSON, both in the manner of Google
// Benchmark, whose scripts can read the JSON. That library is not used: it keeps means where
// quartiles of every pass are wanted, and plain numbers where passes and yardsticks have a
// structure.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/report/report.h"
#include "tools/bench/measure.h"

namespace darb {

/// The head of a results file: machine_json(), the device and its rates.
nlohmann::json context_json(const Device& device, const DeviceRates& rates,
                            const std::string& note);
/// The head as lines, with the heading of the table.
std::string context_text(const nlohmann::json& context);

/// details: below the case's line, add one line per pass and yardstick.
std::string result_text(const BenchResult& result, const DeviceRates& rates, bool details);
nlohmann::json result_json(const BenchResult& result, const DeviceRates& rates);

/// A table of the cases, and one of their passes. context: context_json().
Report bench_report(const std::vector<BenchResult>& results, const DeviceRates& rates,
                    const nlohmann::json& context);

// The commit that the program was built from.

/// Abbreviated hash, with "-dirty" where tracked files differed from it; "unknown" outside of git.
std::string_view build_commit();

}  // namespace darb
