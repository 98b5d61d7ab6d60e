// SPDX-License-Identifier: MIT
// Truncated signed distances: each voxel of the blocks asks each view how far before (+) or behind (-) its surface it
// is, along the view's axis and over the band, and adds that with the weight cos^2/z^2, as depths that are read at a
// grazing angle are before the surface. Before the band it is free, +1; behind it the view says nothing. Sources:
// Curless and Levoy 1996; the falling weight is that of Voxblox (Oleynikova et al. 2017).
// Place: after the blocks around the surface are known. Work: a workgroup a block, several voxels a thread; views in
// order, so sums have the same bits however the views are batched. Shared memory: none. Reads views and depths; reads and
// writes the sums.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/mesh_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = MESH_GROUP;

layout(push_constant, scalar) uniform Push { IntegrateArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Views { MeshView views[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Depths { float depths[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Blocks { ivec3 blocks[]; };  // place, in sides of a block
layout(set = 0, binding = 3, scalar) buffer Sums { vec2 sums[]; };  // [B][BLOCK_VOXELS] weighted distance over band; weight

#include "lib/covariance.glsl"
#include "lib/depth_view.glsl"

ivec3 voxel_of(uint i) {
    return ivec3(i % BLOCK_SIDE, i / BLOCK_SIDE % BLOCK_SIDE, i / (BLOCK_SIDE * BLOCK_SIDE));
}

void main() {
    const uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (block >= args.blocks) return;
    for (uint i = gl_LocalInvocationID.x; i < BLOCK_VOXELS; i += THREADS) {
        const vec3 p = vec3(blocks[block] * int(BLOCK_SIDE) + voxel_of(i)) * args.voxel;
        vec2 sum = sums[block * BLOCK_VOXELS + i];
        for (uint v = 0u; v < args.views; ++v) {
            vec2 pixel;
            float z, cosine;
            if (!place_in_view(views[v], p, pixel, z) || z > args.farthest + args.band) continue;
            const float surface = surface_depth(views[v], pixel, cosine);
            const float distance = (surface - z) / args.band;
            if (!(surface > 0.0) || surface > args.farthest || distance < -1.0) continue;
            // Deep behind it another side of the thing may be nearer: the weight falls from a voxel behind the surface on.
            const float trust = clamp((1.0 + distance) / (1.0 - args.voxel / args.band), 0.0, 1.0);
            const float weight = trust * cosine * cosine / (z * z);
            sum += weight * vec2(min(distance, 1.0), 1.0);
        }
        sums[block * BLOCK_VOXELS + i] = sum;
    }
}
