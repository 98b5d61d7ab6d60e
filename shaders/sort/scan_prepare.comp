// SPDX-License-Identifier: MIT
// Scan, step 1 of 4: turns the element count on the device into chunk and workgroup counts.
// One thread. Reads the count; writes the plan, whose head is an indirect dispatch command.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shaders/shared/scan_args.h"

layout(local_size_x = 1) in;

layout(push_constant, scalar) uniform Push { ScanPrepareArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count_in[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Plan { ScanPlan plan; };

void main() {
    const uint count = min(count_in[args.count_word], args.capacity);
    const uint chunks = count / args.chunk + uint(count % args.chunk != 0);
    plan.groups_x = (chunks + args.teams_per_group - 1) / args.teams_per_group;
    plan.groups_y = 1;
    plan.groups_z = 1;
    plan.count = count;
    plan.chunks = chunks;
}
