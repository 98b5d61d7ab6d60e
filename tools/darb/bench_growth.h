// darb bench --growth.
#pragma once

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

/// Measures, prints the table and writes the files that are named.
void bench_growth(Device& device, const GrowthFlags& flags, const nlohmann::json& context,
                  const std::filesystem::path& json,
                  const std::function<void(const std::string&)>& progress);

}  // namespace darb
