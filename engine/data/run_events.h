// run.jsonl and metrics.json of a run as they are read again, by --resume and by comparisons: what
// is not as a run writes it is an error of input.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

namespace darb {

/// The events of a run.jsonl in their order; none where there is no such file. A last line that a
/// kill cut off does not count. Throws Error naming file, line and key where a line is no event or
/// a value is of another type.
std::vector<nlohmann::json> read_events(const std::filesystem::path& path);

/// Where a run ended.
struct RunEnd {
    int iteration = 0;
    bool interrupted = true;
};

/// Of a metrics.json. Throws Error naming file and key.
RunEnd read_run_end(const std::filesystem::path& path);

/// The whole file, an object whose values that are read again are of their types. Throws Error.
nlohmann::json read_metrics(const std::filesystem::path& path);

}  // namespace darb
