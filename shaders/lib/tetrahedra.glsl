// SPDX-License-Identifier: MIT
// A cube of eight distances, cut into six tetrahedra around its diagonal (Kuhn's): corner c is at (c & 1, c >> 1 & 1,
// c >> 2), and an edge joins corners of which one holds the bits of the other. So each edge is named by the voxel at its
// lower corner and the bits that its upper one has more, 1 to 7, and two cubes that share a face cut it alike.
// Needs args (SurfaceArgs), and the buffers sums and neighbours.

// The voxel at a corner of the cube, in the buffers of the range; NO_BLOCK where its block is not there.
uint corner_voxel(uint block, uvec3 at, uint corner) {
    const uvec3 p = at + uvec3(corner & 1u, corner >> 1 & 1u, corner >> 2);
    const uvec3 over = p / BLOCK_SIDE, within = p % BLOCK_SIDE;
    const uint side = over.x | over.y << 1 | over.z << 2;
    const uint b = side == 0u ? block : neighbours[block * 8u + side];
    if (b == NO_BLOCK) return NO_BLOCK;
    return b * BLOCK_VOXELS + within.x + BLOCK_SIDE * (within.y + BLOCK_SIDE * within.z);
}

// Distances at the corners, and the bits of those that are known and of those that are inside.
struct Cube {
    uint voxel[8];
    float distance[8];
    uint known, inside;
};

Cube load_cube(uint block, uint voxel) {
    const uvec3 at =
        uvec3(voxel % BLOCK_SIDE, voxel / BLOCK_SIDE % BLOCK_SIDE, voxel / (BLOCK_SIDE * BLOCK_SIDE));
    Cube cube;
    cube.known = cube.inside = 0u;
    for (uint c = 0u; c < 8u; ++c) {
        cube.voxel[c] = corner_voxel(block, at, c);
        cube.distance[c] = 1.0;
        if (cube.voxel[c] == NO_BLOCK) continue;
        const vec2 sum = sums[cube.voxel[c]];
        if (!(sum.y > 0.0)) continue;
        cube.distance[c] = sum.x / sum.y;
        cube.known |= 1u << c;
        if (cube.distance[c] < 0.0) cube.inside |= 1u << c;
    }
    return cube;
}

// The bits 1 << d of the edges of this voxel, d from 1 to 7, that the surface cuts.
uint cut_edges(Cube cube) {
    uint mask = 0u;
    for (uint d = 1u; d < 8u; ++d) {
        const bool both = (cube.known & 1u) != 0u && (cube.known >> d & 1u) != 0u;
        if (both && (cube.inside & 1u) != (cube.inside >> d & 1u)) mask |= 1u << d;
    }
    return mask;
}

// Corners of tetrahedron t, from 0 by two steps to 7, and whether their order is that of a right hand.
uvec4 tetrahedron(uint t, out bool right) {
    const uint first = 1u << (t % 3u);
    const uint second = 1u << ((t % 3u + (t < 3u ? 1u : 2u)) % 3u);
    right = t < 3u;
    return uvec4(0u, first, first | second, 7u);
}

uint inside_bits(Cube cube, uvec4 corners) {
    return (cube.inside >> corners.x & 1u) | (cube.inside >> corners.y & 1u) << 1 |
           (cube.inside >> corners.z & 1u) << 2 | (cube.inside >> corners.w & 1u) << 3;
}

// One where a corner is alone on its side, two where two are.
uint faces_of(uint bits) {
    const uint inside = bitCount(bits);
    return inside == 0u || inside == 4u ? 0u : inside == 2u ? 2u : 1u;
}
