// Which cases `darb bench` measures.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/bench/cases.h"

namespace darb {

/// what: a scene of one's own, measured with the photos of `dataset` where one is named; else a
/// regular expression on the names of the cases, "": all. Throws Error where nothing fits.
std::vector<BenchCase> chosen_cases(const std::string& what, const std::filesystem::path& dataset,
                                    bool full);

/// Those whose scenes are there; a line on stderr for each of the others.
std::vector<BenchCase> possible_cases(std::vector<BenchCase> cases, const BenchOptions& options);

}  // namespace darb
