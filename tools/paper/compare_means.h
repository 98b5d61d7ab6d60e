// Means over the data sets of a comparison: over all of them, and over those of each benchmark of
// the paper, with the paper's own.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/paper/compare_runs.h"
#include "tools/paper/compare_stats.h"

namespace darb {

struct Means {
    std::string benchmark;           // empty: all data sets
    std::vector<std::string> names;  // of the data sets
    /// [column][kernel], over the data sets where every kernel has the value.
    std::vector<std::vector<std::optional<double>>> values;
    std::vector<int> covered;  // [column] how many these are
    /// [column][kernel], over the same names; none where the paper has no such column or kernel.
    std::vector<std::vector<std::optional<double>>> paper;
};

/// Of columns at one iteration, the groups that hold more than one data set; all data sets are left
/// out where they are one benchmark.
std::vector<Means> means_of(const Comparison& comparison, int iteration,
                            const std::vector<Column>& columns);

nlohmann::json means_json(const Comparison& comparison);

}  // namespace darb
