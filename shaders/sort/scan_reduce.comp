// SPDX-License-Identifier: MIT
// Scan, step 2 of 4: the sum of every chunk. One team (scan_team.glsl) per chunk, no shared memory. Reads counts [n];
// writes chunk_sums [chunks].
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "shaders/shared/scan_args.h"
#include "shaders/sort/scan_team.glsl"

layout(set = 0, binding = 0, scalar) readonly buffer Plan { ScanPlan plan; };
layout(set = 0, binding = 1, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer ChunkSums { uint chunk_sums[]; };

void main() {
    const uint n = plan.count, chunks = plan.chunks;
    for (uint chunk = first_team(); chunk < chunks; chunk += team_count()) {
        const uint begin = chunk * CHUNK, end = begin + min(CHUNK, n - begin);
        uint sum = 0;
        for (uint i = begin + team_lane(); i < end; i += team_lanes()) sum += counts[i];
        if (!TEAM_IS_THREAD) sum = subgroupAdd(sum);
        if (team_lane() == 0) chunk_sums[chunk] = sum;
    }
}
