// SPDX-License-Identifier: MIT
#include "engine/raster/tile_lists.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr std::uint32_t kFewBins = 4096;
constexpr std::uint32_t kScatterSubgroups = 8;  // they take turns

std::uint32_t bins_for(std::uint32_t tiles) {
    return tiles <= kFewBins ? kFewBins : LIST_MAX_TILES;
}

std::uint64_t list_blocks(std::uint32_t intersections) {
    return (std::uint64_t{intersections} + LIST_BLOCK - 1) / LIST_BLOCK;
}

std::uint64_t count_bytes(std::uint32_t intersections, std::uint32_t tiles) {
    return list_blocks(intersections) * tiles * 4;
}

}  // namespace

bool TileLists::fits(const DeviceInfo& info, std::uint32_t intersections, std::uint32_t tiles) {
    return tiles > 0 && tiles <= LIST_MAX_TILES &&
           bins_for(tiles) * 4 <= info.shared_memory_bytes &&
           info.max_workgroup_threads >= LIST_THREADS &&
           list_blocks(intersections) <= info.max_groups_x &&
           count_bytes(intersections, tiles) <= info.max_storage_buffer_bytes;
}

BufferList<TileLists> TileLists::buffers(std::uint32_t intersections, std::uint32_t tiles) {
    return {{&TileLists::counts_, "tile list counts", count_bytes(intersections, tiles)}};
}

std::uint64_t TileLists::device_bytes(std::uint32_t intersections, std::uint32_t tiles) {
    return charged_bytes(buffers(intersections, tiles));
}

TileLists::TileLists(Device& device, std::uint32_t intersections, std::uint32_t tiles)
    : intersections_(intersections), tiles_(tiles) {
    if (intersections == 0 || !fits(device.info(), intersections, tiles))
        throw Error("tile lists",
                    fmt::format("{} intersections of {} tiles cannot be counted on {}",
                                intersections, tiles, device.info().name),
                    "Ask TileLists::fits first, or sort by digits: --tune lists=digits.");
    const SpecConstants bins{{"BINS", static_cast<std::int32_t>(bins_for(tiles))}};
    count_ = Pipeline(device, "list_counts", bins);
    offset_ = Pipeline(device, "list_offsets");
    range_ = Pipeline(device, "list_ranges");
    SpecConstants scatter = bins;
    const std::uint32_t lanes = device.info().subgroup_size;
    scatter["THREADS"] = static_cast<std::int32_t>(
        std::max(std::min<std::uint32_t>(kScatterSubgroups * lanes, LIST_THREADS), lanes));
    scatter_ = Pipeline(device, "list_scatter", scatter);
    make_buffers(device, *this, buffers(intersections, tiles), "tile sort");
}

void TileLists::record(Commands& commands, const Buffers& b, std::uint32_t tile_count,
                       std::uint32_t list_capacity) {
    if (tile_count > tiles_)
        throw Error("tile lists", fmt::format("{} tiles, made for {}", tile_count, tiles_),
                    "Make it for the most tiles of a picture.");
    const auto blocks = static_cast<std::uint32_t>(list_blocks(intersections_));
    const gpu::ListArgs args{tile_count, list_capacity};
    commands.dispatch(count_, args, {b.count, b.tile, counts_}, blocks);
    commands.dispatch(offset_, args, {b.count, counts_, b.tile_range},
                      (tile_count + LIST_COLUMNS - 1) / LIST_COLUMNS);
    commands.dispatch(range_, args, {b.tile_range, b.status}, 1);
    commands.dispatch(scatter_, args,
                      {b.count, b.tile, counts_, b.tile_range, b.intersection_from_sorted}, blocks);
}

}  // namespace darb
