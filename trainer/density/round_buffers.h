// What one round of density control works with, and what the round takes of device memory.
#pragma once

#include "engine/gpu/buffer_list.h"

namespace darb {

/// The working space of a round over N splats.
struct RoundBuffers {
    Buffer keep, grow, action;        // uint [N]
    Buffer keep_offset, grow_offset;  // uint [N]
    Buffer count, keep_total, grow_total;
    Buffer sources;  // uint [2 N][2]

    static BufferList<RoundBuffers> list(std::uint64_t splats);
};

/// What the floats of a splat depend on.
struct SplatFloats {
    int sh_degree = 0, kernel = 0;
    bool rest_sum = false;  // GpuSplats::rest_sum
};
/// Bytes of GpuSplats::rest_sum of so many splats.
std::uint64_t rest_sum_bytes(std::uint64_t splats, const SplatFloats& of);

/// The most bytes that parameters, moments and working space take at a time while a round makes
/// `after` splats out of `before`: attributes are replaced one at a time, so that one exists twice.
std::uint64_t round_bytes(std::uint32_t before, std::uint32_t after, const SplatFloats& of);

}  // namespace darb
