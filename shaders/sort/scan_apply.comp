// SPDX-License-Identifier: MIT
// Scan, step 4 of 4: the offsets of all elements from the offset of their chunk. One team (scan_team.glsl) per chunk,
// no shared memory. Reads counts [n] and chunk_offsets [chunks]; writes offsets [n]. With IN_PLACE the counts are read
// where the offsets go, through that one binding: two bindings that are not declared Aliased must not reach one buffer.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shaders/shared/scan_args.h"
#include "shaders/sort/scan_team.glsl"

layout(constant_id = 3) const bool IN_PLACE = false;

layout(set = 0, binding = 0, scalar) readonly buffer Plan { ScanPlan plan; };
layout(set = 0, binding = 1, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 2, scalar) readonly buffer ChunkOffsets { uint chunk_offsets[]; };
layout(set = 0, binding = 3, scalar) buffer Offsets { uint offsets[]; };

uint count_at(uint i) { return IN_PLACE ? offsets[i] : counts[i]; }

void scan_by_thread(uint begin, uint end, uint prefix) {
    for (uint i = begin; i < end; ++i) {
        const uint value = count_at(i);
        offsets[i] = prefix;
        prefix += value;
    }
}

// All lanes stay in the loop, because the scan needs them; those past the end add 0.
void scan_by_subgroup(uint begin, uint end, uint prefix) {
    for (uint row = begin; row < end; row += gl_SubgroupSize) {
        const uint i = row + gl_SubgroupInvocationID;
        const uint value = i < end ? count_at(i) : 0;
        const uint exclusive = subgroupExclusiveAdd(value);
        if (i < end) offsets[i] = prefix + exclusive;
        prefix += subgroupBroadcast(exclusive + value, gl_SubgroupSize - 1);
    }
}

void main() {
    const uint n = plan.count, chunks = plan.chunks;
    for (uint chunk = first_team(); chunk < chunks; chunk += team_count()) {
        const uint begin = chunk * CHUNK, end = begin + min(CHUNK, n - begin);
        const uint prefix = chunk_offsets[chunk];
        if (TEAM_IS_THREAD)
            scan_by_thread(begin, end, prefix);
        else
            scan_by_subgroup(begin, end, prefix);
    }
}
