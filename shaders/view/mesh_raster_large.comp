// SPDX-License-Identifier: MIT
// Draws the faces of a mesh that cover many pixels.
// Place: after each step of mesh_raster.comp. Work: a workgroup takes every MESH_LARGE_GROUPS-th face of the list, of
// it every MESH_PARTS-th row of blocks of 8 x 8 pixels, and of a block a pixel a thread. So a thread makes few rounds,
// which lavapipe limits. Shared memory: none. Reads the mesh and the list; writes depths and faces by atomic minima.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/view_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;  // the pixels of a block

layout(push_constant, scalar) uniform Push { MeshDrawArgs args; };
layout(set = 0, binding = 4, scalar) readonly buffer Large { uint large[]; };  // count, then faces

#include "view/mesh_face.glsl"
#include "view/mesh_depth.glsl"

void main() {
    const uint count = large[0];
    const uvec2 in_block = uvec2(gl_LocalInvocationID.x & 7u, gl_LocalInvocationID.x >> 3);
    for (uint n = gl_WorkGroupID.x; n < count; n += MESH_LARGE_GROUPS) {
        const uint id = large[1u + n];
        const Face f = load_face(id);
        uvec2 first, end;
        if (!pixels_of(f, first, end)) continue;
        const uvec2 from = first / 8u, to = (end + 7u) / 8u;
        for (uint y = from.y + gl_WorkGroupID.y; y < to.y; y += MESH_PARTS)
            for (uint x = from.x; x < to.x; ++x) {
                const uvec2 pixel = uvec2(x, y) * 8u + in_block;
                if (pixel.x < args.width && pixel.y < args.height) draw_pixel(f, id, pixel);
            }
    }
}
