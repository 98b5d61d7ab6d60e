// SPDX-License-Identifier: MIT
// Where a splat's shape lies between the rows of a table over it (engine/kernels/shaped_kernel.h). SHAPES: the rows;
// 1: the kernel has no shape, and the buffer of shapes is not read.
layout(constant_id = 2) const uint SHAPES = 1;
layout(constant_id = 3) const float SHAPE_FIRST = 0.0;  // shape of the first row and, below, of the last
layout(constant_id = 4) const float SHAPE_LAST = 1.0;

// The row before it, and how far it is on the way to the next.
uint shape_row(float shape, out float part) {
    const float along = (shape - SHAPE_FIRST) / (SHAPE_LAST - SHAPE_FIRST);
    const float at = along > 0.0 ? min(along, 1.0) * float(SHAPES - 1u) : 0.0;  // so, too, of what is no number
    const uint row = min(uint(at), max(SHAPES, 2u) - 2u);
    part = at - float(row);
    return row;
}
