// Radix sort, once a sort: turns the pair count on the device into block and counter counts.
// One thread. Reads the count; writes the plan, whose head is an indirect dispatch command.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shaders/shared/radix_args.h"

layout(local_size_x = 1) in;

layout(push_constant, scalar) uniform Push { RadixPrepareArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count_in[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Plan { RadixPlan plan; };

void main() {
    const uint count = min(count_in[args.count_word], args.capacity);
    const uint blocks = count / args.block + uint(count % args.block != 0);
    plan.groups_x = blocks;
    plan.groups_y = 1;
    plan.groups_z = 1;
    plan.count = count;
    plan.counters = RADIX_MAX_DIGITS * blocks;
}
