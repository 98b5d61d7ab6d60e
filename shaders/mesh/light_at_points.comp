// SPDX-License-Identifier: MIT
// The share T of a view's light that is left at points of its space, as the picture's splats leave it (docs/math.md,
// Depth of a surface). A point has its own ray, which is not that of a pixel's middle.
// Place: after the lists of a frame are made; no blend is needed. Work: a workgroup is a subgroup and takes up to
// SUBGROUP_SIZE * PIXELS points of one block of 8 x 8 pixels, for which it walks the tile's list once. Shared memory: the
// lists of lib/hits.glsl; no barrier. Reads lists, projected splats and points; writes T, and reads it between the
// segments of long lists.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require

#define RAY_WALK
#include "forward/ray_slice.glsl"
#include "forward/ray_walk.glsl"
layout(push_constant, scalar) uniform Push { PointLightArgs args; };
layout(set = 0, binding = 8, scalar) readonly buffer Points { vec3 points[]; };  // x, y px; depth, world units
layout(set = 0, binding = 9, scalar) readonly buffer Items { uvec4 items[]; };   // tile, block, first point, points
layout(set = 0, binding = 10, scalar) buffer Light { float light[]; };

void main() {
    const uint number = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (number >= args.items) return;
    const uvec4 item = items[number];
    Rays px;
    float farthest = 0.0;
    [[unroll]] for (uint k = 0u; k < PIXELS; ++k) {
        const uint mine = k * SUBGROUP_SIZE + gl_SubgroupInvocationID;
        const vec3 p = points[item.z + min(mine, item.w - 1u)];
        px.centre[k] = p.xy;
        px.first[k] = p.z;
        px.step[k] = 0.0;
        px.end[k] = mine < item.w ? 0xFFFFFFFFu : 0u;
        px.left[k] = 1.0;
        if (args.segment > 0u && mine < item.w) px.left[k] = light[item.z + mine];
        farthest = max(farthest, p.z);
    }
    block_farthest = subgroupMax(farthest);
    const uvec2 whole = tile_range[item.x];
    const uint begin = min(whole.x + args.segment * MEDIAN_SEGMENT, whole.y);
    const uvec2 range = uvec2(begin, min(begin + MEDIAN_SEGMENT, whole.y));
    if (range.x < range.y) walk(px, range, block_bit(item.y));
    [[unroll]] for (uint k = 0u; k < PIXELS; ++k) {
        const uint mine = k * SUBGROUP_SIZE + gl_SubgroupInvocationID;
        if (mine < item.w) light[item.z + mine] = px.left[k];
    }
}
