// darb bench --growth.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>

#include "engine/gpu/device.h"
#include "tools/bench/growth.h"

namespace darb {

struct GrowthFlags {
    bool on = false;
    GrowthPlan plan;
    std::filesystem::path html;
};

/// Adds --growth and what goes with it.
void add_growth_flags(CLI::App& command, GrowthFlags& flags);

/// Measures, prints the table and writes the files that are named.
/// Throws Error where the flags contradict each other. filter: of the cases.
void check_growth(const GrowthFlags& flags, const std::string& filter);

void bench_growth(Device& device, const GrowthFlags& flags, const nlohmann::json& context,
                  const std::filesystem::path& json, bool quiet,
                  const std::function<void(const std::string&)>& progress);

}  // namespace darb
