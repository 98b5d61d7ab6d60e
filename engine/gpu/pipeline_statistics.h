// SPDX-License-Identifier: MIT
// What a device's compiler says of the passes that it compiled: registers, spills, occupancy and
// whatever else it counts (VK_KHR_pipeline_executable_properties). Place:
// DeviceOptions::compile_only collects them; `darb devices --passes` prints them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

struct PipelineStatistic {
    std::string name;         // as the driver has it
    std::string description;  // likewise
    double value = 0;
};

struct CompiledPipeline {
    std::string shader;
    std::string constants;            // those given and declared: "SH_DEGREE=3 THREADS=64"
    std::uint32_t threads = 0;        // per workgroup
    std::uint32_t subgroup_size = 0;  // as the driver says, 0 where it does not
    double compile_ms = 0;
    std::vector<PipelineStatistic> values;  // empty where the driver has no statistics
};

/// The quantities that drivers have names of their own for.
struct CommonStatistics {
    std::optional<double> registers;      // per thread
    std::optional<double> spills;         // registers, or stores and loads of them
    std::optional<double> scratch_bytes;  // private memory per thread or wave
    std::optional<double> shared_bytes;   // per workgroup
    std::optional<double> occupancy;      // subgroups that a core holds at a time
    std::optional<double> instructions;
    std::optional<double> cycles;  // static: loops once, or as the driver guesses
};
/// Finds them by the names of RADV, NVK, ANV, Turnip and Honeykrisp; what a driver lacks stays
/// empty.
CommonStatistics common_statistics(const CompiledPipeline& pipeline);

}  // namespace darb
