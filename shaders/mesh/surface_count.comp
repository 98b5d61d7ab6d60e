// SPDX-License-Identifier: MIT
// How many vertices and faces each voxel makes: a vertex for each of its seven edges that the surface cuts, the faces of
// the six tetrahedra of its cube. A cube with a corner that no view knows has no faces.
// Place: after the distances; the counts are then summed. Work: one thread a voxel of the range and its shell. Shared
// memory: none. Reads distances and neighbours; writes cut edges and both counts.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/mesh_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = MESH_GROUP;

layout(push_constant, scalar) uniform Push { SurfaceArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Sums { vec2 sums[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Neighbours { uint neighbours[]; };  // [B][8] by the bits of x, y, z
layout(set = 0, binding = 2, scalar) writeonly buffer Edges { uint edges[]; };           // [B][BLOCK_VOXELS]
layout(set = 0, binding = 3, scalar) writeonly buffer VertexCount { uint vertex_count[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer FaceCount { uint face_count[]; };

#include "lib/linear_id.glsl"
#include "lib/tetrahedra.glsl"

void main() {
    const uint i = linear_id(), block = i / BLOCK_VOXELS;
    if (block >= args.blocks) return;
    const Cube cube = load_cube(block, i % BLOCK_VOXELS);
    const uint mask = cut_edges(cube);
    uint faces = 0u;
    if (block < args.own && cube.known == 0xFFu) {
        for (uint t = 0u; t < 6u; ++t) {
            bool right;
            faces += faces_of(inside_bits(cube, tetrahedron(t, right)));
        }
    }
    edges[i] = mask;
    vertex_count[i] = bitCount(mask);
    face_count[i] = faces;
}
