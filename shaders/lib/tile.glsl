// SPDX-License-Identifier: MIT
// The part of a splat's ellipse within a band of pixel rows, for the tiles of a splat and the blocks of a tile: the
// ellipse touches a rectangle where its part in the rectangle's rows reaches the rectangle's columns.

// The ellipse of one splat, q <= reach, with slack for rounding: what a pass skips must certainly be below the alpha
// cut-off.
struct EllipseRows {
    vec2 mean;             // px
    float l21, l22, width; // width: 1 / l11
    float reach;           // with the slack
    float top;             // the largest |dy|, d = mean - pixel
    float lean;            // dy where dx is largest
};

EllipseRows ellipse_rows(vec2 mean, float l11, float l21, float l22, float reach) {
    EllipseRows e;
    e.mean = mean;
    e.l21 = l21;
    e.l22 = l22;
    e.width = 1.0 / l11;
    e.reach = reach * 1.001 + 1e-3;
    e.top = sqrt(e.reach) / l22;
    const float tilt = clamp(l21 / l22, -1e15, 1e15);
    e.lean = -e.top * tilt * inversesqrt(1.0 + tilt * tilt);
    return e;
}

// The lowest and highest x, in px, of the ellipse between two rows of pixel centres; low > high where it has none.
vec2 columns_between(EllipseRows e, float low_y, float high_y) {
    const float near = max(e.mean.y - high_y, -e.top), far = min(e.mean.y - low_y, e.top);
    // dy of the largest and of the smallest dx
    const float right = clamp(e.lean, near, far), left = clamp(-e.lean, near, far);
    const float v = e.l22 * right, w = e.l22 * left;
    const float most = (sqrt(max(e.reach - v * v, 0.0)) - e.l21 * right) * e.width;
    const float least = (sqrt(max(e.reach - w * w, 0.0)) + e.l21 * left) * -e.width;
    return near > far ? vec2(1.0, -1.0) : e.mean.x - vec2(most, least);
}

// A splat's tiles: a rectangle of tiles cut into at most 8 x 8 cells, with one bit for each cell that the ellipse
// touches; those of a row are contiguous. Counting and emission both read this, so they cannot disagree.
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
