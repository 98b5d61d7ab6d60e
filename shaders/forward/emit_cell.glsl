// The pairs of one cell of a splat's cover, for emit.comp and emit_huge.comp, which declare args, pair_tile and
// pair_splat. Needs tile.glsl.

struct Ellipse {
    vec4 shape;  // mean, l11, l21
    vec2 bound;  // l22, reach
};

uint touched_blocks(Ellipse e, uvec2 tile) {
    uint bits = 0u;
    for (uint block = 0u; block < 4u; ++block) {
        const vec2 low = vec2(tile * TILE_SIZE + uvec2(block & 1u, block >> 1) * 8u) + 0.5;
        const float q = smallest_q(e.shape.xy, e.shape.z, e.shape.w, e.bound.x, low, low + 7.0);
        if (reaches(q, e.bound.y)) bits |= 1u << block;
    }
    return bits << PAIR_BLOCK_SHIFT;
}

// Returns the slot after the cell's last pair.
uint emit_cell(TileCover c, uint cell, uint splat, Ellipse e, uint slot) {
    const uvec2 size = cell_size(c.extent);
    const uvec2 first = uvec2(cell & 7u, cell >> 3) * size;
    const uvec2 last = min(first + size, c.extent);
    for (uint y = first.y; y < last.y; ++y) {
        for (uint x = first.x; x < last.x; ++x) {
            if (slot < args.pair_capacity) {
                const uvec2 tile = c.origin + uvec2(x, y);
                pair_tile[slot] = tile.y * args.tiles_x + tile.x;
                pair_splat[slot] = splat | touched_blocks(e, tile);
            }
            ++slot;
        }
    }
    return slot;
}
