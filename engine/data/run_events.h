// SPDX-License-Identifier: MIT
// Reads the run.jsonl and metrics.json of a run again, for --resume and for comparisons. Content
// that no run writes is an input error.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

namespace darb {

/// The events of a run.jsonl in order; none where the file does not exist. A last line that was cut
/// off when the run was killed is ignored. Throws Error naming file, line and key where a line is
/// not an event or a value has the wrong type.
std::vector<nlohmann::json> read_events(const std::filesystem::path& path);

/// Where a run ended.
struct RunEnd {
    int iteration = 0;
    bool interrupted = true;
};

/// Reads it from a metrics.json. Throws Error naming file and key.
RunEnd read_run_end(const std::filesystem::path& path);

/// The whole metrics.json: an object in which the values that are read again have been checked for
/// their types. Throws Error naming file and key.
nlohmann::json read_metrics(const std::filesystem::path& path);

}  // namespace darb
