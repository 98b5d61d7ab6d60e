// SPDX-License-Identifier: MIT
// Scan: exclusive prefix sum of uint32 on the device, reduce-then-scan in four dispatches (prepare,
// reduce, top, apply; after Merrill and Grimshaw 2009). It assumes no forward progress between
// workgroups and no subgroup size, and the result never depends on timing.
#pragma once

#include <cstdint>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"

namespace darb {

class Scan {
  public:
    struct Strategy {
        bool team_is_thread = false;      // else a subgroup; see shaders/sort/scan_team.glsl
        std::uint32_t subgroup_size = 0;  // 0 = the device's own
    };
    static Strategy best_strategy(const Device& device);

    /// The largest capacity that the device's limits on workgroups allow.
    static std::uint64_t max_capacity(const Device& device, const Strategy& strategy);
    /// capacity: the largest number of elements, > 0. Allocates one word of scratch memory per
    /// chunk of elements. Throws Error beyond max_capacity.
    Scan(Device& device, std::uint32_t capacity);
    Scan(Device& device, std::uint32_t capacity, const Strategy& strategy);

    std::uint32_t capacity() const { return capacity_; }

    /// Device memory taken by a scan of this capacity, bytes.
    static std::uint64_t device_bytes(std::uint32_t capacity);

    /// offsets[i] = counts[0] + ... + counts[i - 1] for i < n, modulo 2^32, where n is the word of
    /// count_buffer at count_offset (bytes, a multiple of 4), limited to the capacity; n = 0 is
    /// allowed. The sum of all n is written to the word of total at its offset (a multiple of 4).
    /// counts and offsets hold [capacity] words, and may be the same buffer. Records into the
    /// current pass() of commands.
    void record(Commands& commands, const Buffer& counts, const Buffer& offsets,
                const Buffer& count_buffer, std::uint64_t count_offset, const BufferRange& total);

  private:
    static BufferList<Scan> buffers(std::uint32_t capacity);

    std::uint32_t capacity_;
    std::uint32_t teams_per_group_;
    Pipeline prepare_, reduce_, top_, apply_, apply_in_place_;
    Buffer plan_;
    Buffer chunk_sums_;
};

}  // namespace darb
