// SPDX-License-Identifier: MIT
// Vertices and faces of the zero level, by marching tetrahedra: on each cut edge the point where the distance, linear
// between its ends, is 0. Faces are counter-clockwise seen from free space.
// Place: after the counts are summed. Work: one thread a voxel of the range and its shell. Shared memory: none. Reads
// distances, neighbours, cut edges and where each voxel's output begins; writes vertices with the names of their edges,
// and faces.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/mesh_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = MESH_GROUP;

layout(push_constant, scalar) uniform Push { SurfaceArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Sums { vec2 sums[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Neighbours { uint neighbours[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Edges { uint edges[]; };
layout(set = 0, binding = 3, scalar) readonly buffer VertexOffset { uint vertex_offset[]; };
layout(set = 0, binding = 4, scalar) readonly buffer FaceOffset { uint face_offset[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Blocks { ivec3 blocks[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Vertices { vec3 vertices[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Names { uint names[]; };  // 8 * voxel of the range + edge
layout(set = 0, binding = 8, scalar) writeonly buffer Faces { uvec3 faces[]; };

#include "lib/linear_id.glsl"
#include "lib/tetrahedra.glsl"

// The vertex between two corners of a tetrahedron, of which one holds the bits of the other.
uint vertex_between(Cube cube, uint a, uint b) {
    const uint low = a & b, edge = a ^ b, owner = cube.voxel[low];
    return vertex_offset[owner] + bitCount(edges[owner] & ((1u << edge) - 1u));
}

void emit_vertices(Cube cube, uint block, uint voxel, uint i) {
    uint to = vertex_offset[i], mask = edges[i];
    const ivec3 at = blocks[block] * int(BLOCK_SIDE) +
                     ivec3(voxel % BLOCK_SIDE, voxel / BLOCK_SIDE % BLOCK_SIDE, voxel / (BLOCK_SIDE * BLOCK_SIDE));
    while (mask != 0u) {
        const uint d = uint(findLSB(mask));
        mask &= mask - 1u;
        const float share = cube.distance[0] / (cube.distance[0] - cube.distance[d]);
        const vec3 step = vec3(d & 1u, d >> 1 & 1u, d >> 2);
        vertices[to] = (vec3(at) + share * step) * args.voxel;
        names[to] = i * 8u + d;
        ++to;
    }
}

// Three corners of a face, turned where `flip`.
void put(inout uint to, uint a, uint b, uint c, bool flip) {
    faces[to] = flip ? uvec3(a, c, b) : uvec3(a, b, c);
    ++to;
}

void emit_tetrahedron(Cube cube, uvec4 c, bool right, inout uint to) {
    uint bits = inside_bits(cube, c);
    const uint count = faces_of(bits);
    if (count == 1u) {  // the corner that is alone, and the others in the order in which it sees them turn
        const bool out_alone = bitCount(bits) == 3;
        const uint k = uint(findLSB(out_alone ? ~bits & 15u : bits));
        const uint x = k == 0u ? 1u : 0u, y = k <= 1u ? 2u : 1u, z = k <= 2u ? 3u : 2u;
        put(to, vertex_between(cube, c[k], c[x]), vertex_between(cube, c[k], c[y]), vertex_between(cube, c[k], c[z]),
            ((k & 1u) != 0u) != (out_alone == right));
    } else if (count == 2u) {  // a quadrilateral between corners (k, l) inside and (m, n) outside
        const uint k = uint(findLSB(bits)), l = uint(findMSB(bits));
        const uint m = uint(findLSB(~bits & 15u)), n = uint(findMSB(~bits & 15u));
        const uint km = vertex_between(cube, c[k], c[m]), kn = vertex_between(cube, c[k], c[n]);
        const uint lm = vertex_between(cube, c[l], c[m]), ln = vertex_between(cube, c[l], c[n]);
        const bool odd = (k == 0u && l == 2u) || (k == 1u && l == 3u);  // (k, l, m, n) is an odd order of the corners
        const bool flip = odd == right;
        put(to, km, kn, ln, flip);
        put(to, km, ln, lm, flip);
    }
}

void main() {
    const uint i = linear_id(), block = i / BLOCK_VOXELS;
    if (block >= args.blocks) return;
    const Cube cube = load_cube(block, i % BLOCK_VOXELS);
    emit_vertices(cube, block, i % BLOCK_VOXELS, i);
    if (block >= args.own || cube.known != 0xFFu || cube.inside == 0u || cube.inside == 0xFFu) return;
    uint to = face_offset[i];
    for (uint t = 0u; t < 6u; ++t) {
        bool right;
        const uvec4 corners = tetrahedron(t, right);
        emit_tetrahedron(cube, corners, right, to);
    }
}
