// SPDX-License-Identifier: MIT
#include "engine/gpu/pipeline_statistics.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/gpu/device_state.h"

namespace darb {

namespace {

double as_number(const VkPipelineExecutableStatisticKHR& statistic) {
    switch (statistic.format) {
        case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_BOOL32_KHR:
            return statistic.value.b32 != 0;
        case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_INT64_KHR:
            return static_cast<double>(statistic.value.i64);
        case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_UINT64_KHR:
            return static_cast<double>(statistic.value.u64);
        default:
            return statistic.value.f64;
    }
}

// "VGPRs" and "Number of VGPRs" are told apart by nothing that matters.
std::string plain(std::string_view name) {
    std::string out;
    for (const char c : name)
        if (std::isalnum(static_cast<unsigned char>(c)) != 0)
            out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return out;
}

std::optional<double> sum_of(const CompiledPipeline& pipeline,
                             std::initializer_list<std::string_view> names) {
    std::optional<double> sum;
    for (const PipelineStatistic& one : pipeline.values)
        if (std::find(names.begin(), names.end(), plain(one.name)) != names.end())
            sum = sum.value_or(0) + one.value;
    return sum;
}

}  // namespace

void Device::State::note_compiled(VkPipeline pipeline, CompiledPipeline row) {
    std::uint32_t executables = 0, count = 0;
    VkPipelineInfoKHR of{};
    of.sType = VK_STRUCTURE_TYPE_PIPELINE_INFO_KHR;
    of.pipeline = pipeline;
    if (executable.properties != nullptr)
        check_vulkan(executable.properties(device, &of, &executables, nullptr), row.shader);
    std::vector<VkPipelineExecutablePropertiesKHR> all(executables);
    for (auto& one : all) one.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_PROPERTIES_KHR;
    if (executables != 0)
        check_vulkan(executable.properties(device, &of, &executables, all.data()), row.shader);
    for (std::uint32_t i = 0; i < executables; ++i) {
        row.subgroup_size = all[i].subgroupSize;
        VkPipelineExecutableInfoKHR which{};
        which.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INFO_KHR;
        which.pipeline = pipeline;
        which.executableIndex = i;
        check_vulkan(executable.statistics(device, &which, &count, nullptr), row.shader);
        std::vector<VkPipelineExecutableStatisticKHR> values(count);
        for (auto& value : values)
            value.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_STATISTIC_KHR;
        check_vulkan(executable.statistics(device, &which, &count, values.data()), row.shader);
        for (const auto& value : values)
            row.values.push_back({value.name, value.description, as_number(value)});
    }
    compiled.push_back(std::move(row));
}

CommonStatistics common_statistics(const CompiledPipeline& pipeline) {
    CommonStatistics c;
    c.registers = sum_of(pipeline, {"vgprs", "numberofgprs", "gprs", "registers", "registercount",
                                    "maxliveregisters", "fullregisters"});
    c.spills = sum_of(
        pipeline, {"spilledvgprs", "spilledsgprs", "spillstomemory", "fillsfrommemory",
                   "spillstoreg", "fillsfromreg", "spillcount", "fillcount", "spills", "fills"});
    c.scratch_bytes = sum_of(pipeline, {"scratchsize", "slmsize", "scratchmemorysize",
                                        "privatememory", "localmemory", "scratch"});
    c.shared_bytes = sum_of(pipeline, {"ldssize", "sharedmemory", "workgroupmemorysize"});
    c.occupancy = sum_of(pipeline, {"subgroupspersimd", "occupancy", "maxwarpssm", "maxwaves"});
    c.instructions = sum_of(pipeline, {"instructions", "instructioncount", "instrs"});
    c.cycles = sum_of(pipeline, {"latency", "staticcyclecount", "cyclecount", "cycles"});
    return c;
}

// The pipeline cache on disk: a magic word and a hash before the driver's bytes, because drivers
// have crashed on cut or flipped caches.

namespace {

struct CacheHead {
    std::uint64_t magic;
    std::uint64_t hash;
};
constexpr std::uint64_t kCacheMagic = 0x3148434342524144;  // "DARBCCH1"

// FNV-1a, 64 bits.
std::uint64_t hash_bytes(std::span<const std::byte> data) {
    std::uint64_t hash = 0xcbf29ce484222325;
    for (const std::byte byte : data)
        hash = (hash ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3;
    return hash;
}

}  // namespace

std::vector<std::byte> load_pipeline_cache(const std::filesystem::path& file) try {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) return {};
    std::vector<std::byte> bytes = read_file(file);
    CacheHead head{};
    if (bytes.size() < sizeof(head)) return {};
    std::memcpy(&head, bytes.data(), sizeof(head));
    bytes.erase(bytes.begin(), bytes.begin() + sizeof(head));
    if (head.magic != kCacheMagic || head.hash != hash_bytes(bytes)) return {};
    return bytes;
} catch (const Error&) {
    return {};
}

void save_pipeline_cache(const std::filesystem::path& file, std::span<const std::byte> data) try {
    const CacheHead head{kCacheMagic, hash_bytes(data)};
    std::vector<std::byte> bytes(sizeof(head) + data.size());
    std::memcpy(bytes.data(), &head, sizeof(head));
    if (!data.empty()) std::memcpy(bytes.data() + sizeof(head), data.data(), data.size());
    write_file_atomic(file, bytes);
} catch (const Error&) {
}

}  // namespace darb
