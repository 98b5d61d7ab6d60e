// SPDX-License-Identifier: MIT
#include "engine/primitives/scan.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "shaders/shared/scan_args.h"

namespace darb {

namespace {

// Elements in a chunk. More elements mean fewer chunk sums for the one workgroup at the top; fewer
// mean more parallel work. With 65,535 groups of at least 4 teams, the scan holds over 67 M
// elements.
constexpr std::uint32_t kChunk = 256;
constexpr std::uint32_t kThreads = 128, kThreadsLavapipe = 32;
constexpr std::uint32_t kTopThreads = 256, kTopThreadsLavapipe = 32;

std::uint32_t team_threads(const Device& device, const Scan::Strategy& strategy) {
    if (strategy.team_is_thread) return 1;
    return strategy.subgroup_size != 0 ? strategy.subgroup_size : device.info().subgroup_size;
}

std::uint32_t group_threads(const Device& device) {
    return device.is_lavapipe() ? kThreadsLavapipe : kThreads;
}

std::uint32_t teams_per_group(const Device& device, const Scan::Strategy& strategy) {
    return std::max(group_threads(device) / team_threads(device, strategy), 1U);
}

SpecConstants constants(const Device& device, const Scan::Strategy& strategy) {
    return {{"THREADS", static_cast<std::int32_t>(group_threads(device))},
            {"CHUNK", static_cast<std::int32_t>(kChunk)},
            {"TEAM_IS_THREAD", strategy.team_is_thread ? 1 : 0}};
}

SpecConstants apply_constants(const Device& device, const Scan::Strategy& strategy, bool in_place) {
    SpecConstants result = constants(device, strategy);
    result["IN_PLACE"] = in_place ? 1 : 0;
    return result;
}

void check_word(const Buffer& buffer, std::uint64_t offset) {
    if (offset % 4 != 0 || offset + 4 > buffer.bytes())
        throw Error("scan",
                    fmt::format("there is no word at byte {} of a buffer of {} bytes", offset,
                                buffer.bytes()),
                    "Use a multiple of 4 within the buffer.");
}

SpecConstants top_constants(const Device& device) {
    const std::uint32_t threads = device.is_lavapipe() ? kTopThreadsLavapipe : kTopThreads;
    return {{"THREADS", static_cast<std::int32_t>(threads)}};
}

}  // namespace

Scan::Strategy Scan::best_strategy(const Device& device) {
    return {device.tuning().scan_by_thread, 0};
}

Scan::Scan(Device& device, std::uint32_t capacity)
    : Scan(device, capacity, best_strategy(device)) {}

Scan::Scan(Device& device, std::uint32_t capacity, const Strategy& strategy)
    : capacity_(capacity),
      prepare_(device, "scan_prepare"),
      reduce_(device, "scan_reduce", constants(device, strategy), true, strategy.subgroup_size),
      top_(device, "scan_top", top_constants(device), true, strategy.subgroup_size),
      apply_(device, "scan_apply", apply_constants(device, strategy, false), true,
             strategy.subgroup_size),
      apply_in_place_(device, "scan_apply", apply_constants(device, strategy, true), true,
                      strategy.subgroup_size) {
    if (capacity == 0)
        throw Error("scan", "its capacity is 0 elements", "Make it for at least one.");
    if (capacity > max_capacity(device, strategy))
        throw NoRoom(
            "scan",
            fmt::format("{} elements are more than {} allows", capacity, device.info().name),
            "Use smaller images or fewer splats, or choose another device (darb devices).");
    make_buffers(device, *this, buffers(capacity), "scan");
    teams_per_group_ = teams_per_group(device, strategy);
}

std::uint64_t Scan::max_capacity(const Device& device, const Strategy& strategy) {
    return std::uint64_t{kChunk} * teams_per_group(device, strategy) * device.info().max_groups_x;
}

BufferList<Scan> Scan::buffers(std::uint32_t capacity) {
    const std::uint64_t chunks = (std::uint64_t{capacity} + kChunk - 1) / kChunk;
    return {{&Scan::plan_, "scan plan", sizeof(gpu::ScanPlan)},
            {&Scan::chunk_sums_, "scan chunk sums", chunks * sizeof(std::uint32_t)}};
}

std::uint64_t Scan::device_bytes(std::uint32_t capacity) {
    return charged_bytes(buffers(capacity));
}

void Scan::record(Commands& commands, const Buffer& counts, const Buffer& offsets,
                  const Buffer& count_buffer, std::uint64_t count_offset,
                  const BufferRange& total) {
    const std::uint64_t bytes = std::uint64_t{capacity_} * sizeof(std::uint32_t);
    if (counts.bytes() < bytes || offsets.bytes() < bytes)
        throw Error("scan",
                    fmt::format("buffers of {} and {} bytes do not hold its capacity of {} words",
                                counts.bytes(), offsets.bytes(), capacity_),
                    "Give it buffers of its capacity.");
    check_word(count_buffer, count_offset);
    check_word(*total.buffer, total.offset);
    const gpu::ScanPrepareArgs args{capacity_, static_cast<std::uint32_t>(count_offset / 4), kChunk,
                                    teams_per_group_};
    const gpu::ScanTopArgs top_args{static_cast<std::uint32_t>(total.offset / 4)};
    commands.dispatch(prepare_, args, {count_buffer, plan_}, 1);
    commands.dispatch_indirect(reduce_, NoArgs{}, {plan_, counts, chunk_sums_}, plan_, 0);
    commands.dispatch(top_, top_args, {plan_, chunk_sums_, *total.buffer}, 1);
    commands.dispatch_indirect(&counts == &offsets ? apply_in_place_ : apply_, NoArgs{},
                               {plan_, counts, chunk_sums_, offsets}, plan_, 0);
}

}  // namespace darb
