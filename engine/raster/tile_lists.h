// SPDX-License-Identifier: MIT
// TileLists: the lists of the tiles from intersections in the order of depth, by one counting pass:
// counts per block of intersections -> offsets -> ranges of the tiles -> scatter. Intersections of
// a tile stay in their order, so the lists are those of a stable sort by tile, to the bit.
#pragma once

#include <cstdint>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/gpu/pipeline.h"
#include "shaders/shared/list_args.h"

namespace darb {

class TileLists {
  public:
    /// Whether a device can count so many intersections of so many tiles: a counter for each tile
    /// must fit into shared memory, and the table of counts into a binding.
    static bool fits(const DeviceInfo& info, std::uint32_t intersections, std::uint32_t tiles);
    /// Device memory that it takes, bytes: 4 for each tile and each block of 8,192 intersections.
    static std::uint64_t device_bytes(std::uint32_t intersections, std::uint32_t tiles);

    /// Both are the most that record() takes, and fit.
    TileLists(Device& device, std::uint32_t intersections, std::uint32_t tiles);
    std::uint32_t intersections() const { return intersections_; }
    std::uint32_t tiles() const { return tiles_; }

    struct Buffers {
        const Buffer& count;  // word: how many intersections there are, at most intersections()
        const Buffer& tile;   // [K] tile of each; one that is not below the number of tiles is in
                              // no list
        const Buffer& intersection_from_sorted;  // [K], written
        const Buffer& tile_range;  // uvec2[T], written: begin and end of a list; (0, 0) if empty
        const Buffer& status;      // gpu::FrameStatus: longest_list and overflow
    };
    /// list_capacity: the longest list that the blend dispatches process; a longer one raises
    /// OVERFLOW_LISTS. Records into the current pass() of commands.
    void record(Commands& commands, const Buffers& buffers, std::uint32_t tile_count,
                std::uint32_t list_capacity);

  private:
    static BufferList<TileLists> buffers(std::uint32_t intersections, std::uint32_t tiles);

    std::uint32_t intersections_, tiles_;
    Pipeline count_, offset_, range_, scatter_;
    Buffer counts_;  // [block][tile]: of the block; then of the blocks before it
};

}  // namespace darb
