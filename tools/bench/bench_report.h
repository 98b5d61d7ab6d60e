// Results of `darb bench` as lines on a terminal and as JSON, both in the manner of Google
// Benchmark: its scripts read the JSON. The library itself is not used: it keeps means where
// quartiles of every pass are wanted, and numbers alone where passes and yardsticks have a
// structure.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "engine/gpu/device.h"
#include "tools/bench/measure.h"

namespace darb {

/// What a file says before its results: machine_json(), the device and its rates.
nlohmann::json context_json(const Device& device, const DeviceRates& rates,
                            const std::string& note);
/// The same in lines, with the heading of the table.
std::string context_text(const nlohmann::json& context);

/// details: a line a pass and a yardstick below the case's own.
std::string result_text(const BenchResult& result, const DeviceRates& rates, bool details);
nlohmann::json result_json(const BenchResult& result, const DeviceRates& rates);

}  // namespace darb
