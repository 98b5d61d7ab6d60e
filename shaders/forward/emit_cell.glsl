// SPDX-License-Identifier: MIT
// Writes the intersections for cells of a splat's cover, for emit.comp and emit_huge.comp, which declare args,
// tile_from_intersection and splat_from_intersection. Needs tile.glsl.

uint touched_blocks(EllipseRows e, uvec2 tile) {
    const vec2 corner = vec2(tile * TILE_SIZE) + 0.5;
    uint bits = 0u;
    for (uint row = 0u; row < 2u; ++row) {
        const float low = corner.y + float(row) * 8.0;
        const vec2 x = columns_between(e, low, low + 7.0) - corner.x;
        if (x.x <= x.y && x.x <= 7.0 && x.y >= 0.0) bits |= 1u << (2u * row);
        if (x.x <= x.y && x.x <= 15.0 && x.y >= 8.0) bits |= 2u << (2u * row);
    }
    return bits << INTERSECTION_BLOCK_SHIFT;
}

// Writes an intersection for each tile of the cells in `bits`, which are not empty, from `slot` on. It is one loop that
// is tested at its bottom: lavapipe runs the body of a loop that is tested at its top once more, behind a mask.
void emit_cells(TileCover c, uvec2 bits, uint splat, EllipseRows e, uint slot) {
    const uvec2 size = cell_size(c.extent);
    uvec2 tile = uvec2(0), first = uvec2(0), last = uvec2(0);  // tiles of the cell; none yet
    do {
        if (tile.y == last.y) {
            const uint cell = bits.x != 0u ? uint(findLSB(bits.x)) : uint(findLSB(bits.y)) + 32u;
            if (bits.x != 0u) bits.x &= bits.x - 1u; else bits.y &= bits.y - 1u;
            first = uvec2(cell & 7u, cell >> 3) * size;
            last = min(first + size, c.extent);
            tile = first;
        }
        if (slot < args.intersection_capacity) {
            const uvec2 at = c.origin + tile;
            tile_from_intersection[slot] = at.y * args.tiles_x + at.x;
            splat_from_intersection[slot] = splat | touched_blocks(e, at);
        }
        ++slot;
        ++tile.x;
        if (tile.x == last.x) tile = uvec2(first.x, tile.y + 1u);
    } while (tile.y != last.y || (bits.x | bits.y) != 0u);
}
