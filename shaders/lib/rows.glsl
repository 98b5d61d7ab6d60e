// SPDX-License-Identifier: MIT
// Where the harmonics above the first band lie, and what belongs to them (moments, gradients, sums). They lie in blocks
// of ROW_BLOCK splats, and in each block one column of ROW_BLOCK vec4 follows the other. So neighbouring threads read
// neighbouring words, and a thread reads four floats at once. engine/raster/attribute_rows.h does the same on the host.

// Where a column of splat `row` of the bound range lies. columns: how many columns a splat has.
uint column_at(uint row, uint column, uint columns) {
    return (row / ROW_BLOCK * columns + column) * ROW_BLOCK + row % ROW_BLOCK;
}
