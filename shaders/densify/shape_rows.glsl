// SPDX-License-Identifier: MIT
// Finds where a splat's shape lies between the rows of a table over it (engine/kernels/shaped_kernel.h). SHAPES is the
// number of rows. With 1 the kernel has no shape, and the buffer of shapes is not read.
layout(constant_id = 2) const uint SHAPES = 1;
layout(constant_id = 3) const float SHAPE_FIRST = 0.0;  // shape of the first row and, below, of the last
layout(constant_id = 4) const float SHAPE_LAST = 1.0;

// The row before the shape, and how far the shape is on the way to the next row.
uint shape_row(float shape, out float part) {
    const float along = (shape - SHAPE_FIRST) / (SHAPE_LAST - SHAPE_FIRST);
    const float at = along > 0.0 ? min(along, 1.0) * float(SHAPES - 1u) : 0.0;  // holds for NaN, too
    const uint row = min(uint(at), max(SHAPES, 2u) - 2u);
    part = at - float(row);
    return row;
}
