// Exact test of a splat's ellipse against a rectangle of pixel centres, used for tile bounds and for the
// blocks of a subgroup in the blend passes.

// The smallest q over the rectangle [low, high]; mean and corners in px. q is convex, so its minimum lies
// where the rectangle faces the mean; both facing edges are tried, each with the other axis free.
float smallest_q(vec2 mean, float l11, float l21, float l22, vec2 low, vec2 high) {
    const vec2 near_low = mean - high, near_high = mean - low;  // the range of d = mean - pixel
    const vec2 facing = clamp(vec2(0.0), near_low, near_high);
    const float dy = clamp(-l11 * l21 * facing.x / (l21 * l21 + l22 * l22), near_low.y, near_high.y);
    const float dx = clamp(-l21 * facing.y / l11, near_low.x, near_high.x);
    const float x0 = l11 * facing.x + l21 * dy, y0 = l22 * dy;
    const float x1 = l11 * dx + l21 * facing.y, y1 = l22 * facing.y;
    return min(x0 * x0 + y0 * y0, x1 * x1 + y1 * y1);
}

// Slack for the rounding of q: what a pass skips must be below the alpha cut-off for certain.
bool reaches(float q, float reach) {
    return q <= reach * 1.001 + 1e-3;
}

// A splat's tiles: a rectangle of tiles cut into at most 8 x 8 cells, with one bit for each cell that the
// ellipse touches. Count and emission both read this, so they cannot disagree.
struct TileCover {
    uvec2 origin;  // tile
    uvec2 extent;  // tiles
    uvec2 bits;    // cell y * 8 + x; x: rows 0-3, y: rows 4-7
};

uvec2 cell_size(uvec2 extent) {
    return (extent + 7u) / 8u;
}

// Packed into four words: origin and extent in 16 bits each (images up to a million pixels a side).
uvec4 pack_cover(TileCover c) {
    return uvec4(c.origin.x | (c.origin.y << 16), c.extent.x | (c.extent.y << 16), c.bits);
}
TileCover unpack_cover(uvec4 w) {
    return TileCover(uvec2(w.x & 0xFFFFu, w.x >> 16), uvec2(w.y & 0xFFFFu, w.y >> 16), w.zw);
}
