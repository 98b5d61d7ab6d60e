// SPDX-License-Identifier: MIT
// The SSIM window as it walks down and across a strip. Loop bounds and indices are constants after unrolling, so
// everything stays in registers. The includer declares LANES and COLUMNS.

// Mean and mean square of the 11 rows at column k.
void blur_down(in float v[11][COLUMNS], int k, out float mean, out float mean_square) {
    float q[11];
    [[unroll]] for (int j = 0; j < 11; ++j) q[j] = v[j][k] * v[j][k];
    mean = blur(v[5][k], v[4][k] + v[6][k], v[3][k] + v[7][k], v[2][k] + v[8][k],
                v[1][k] + v[9][k], v[0][k] + v[10][k]);
    mean_square = blur(q[5], q[4] + q[6], q[3] + q[7], q[2] + q[8], q[1] + q[9], q[0] + q[10]);
}

// The lane DELTA beside this one in its cluster, cyclic; what wraps around lands in the halo.
uint lane_beside(int delta) {
    const uint lane = gl_SubgroupInvocationID, last = uint(LANES - 1);
    return (lane & ~last) | ((lane + uint(delta)) & last);
}

void blur_across(inout float v[COLUMNS]) {
    float wide[COLUMNS + 10];  // columns -5 .. COLUMNS + 4 of this lane
    [[unroll]] for (int j = 0; j < COLUMNS + 10; ++j) {
        const int delta = (j - 5 + 8 * COLUMNS) / COLUMNS - 8;
        const int k = j - 5 - delta * COLUMNS;
        wide[j] = delta == 0 ? v[k] : subgroupShuffle(v[k], lane_beside(delta));
    }
    [[unroll]] for (int k = 0; k < COLUMNS; ++k) {
        v[k] = blur(wide[k + 5], wide[k + 4] + wide[k + 6], wide[k + 3] + wide[k + 7],
                    wide[k + 2] + wide[k + 8], wide[k + 1] + wide[k + 9], wide[k] + wide[k + 10]);
    }
}

// Adds one row to the sums of the 11 rows that its window reaches, and returns the sum that is complete, 5 rows above.
// sums[j] belongs to the row j - 4 below the new one, before this call.
float step_down(inout float sums[10][COLUMNS], int k, float v) {
    const float taps[11] =
        float[](TAP5, TAP4, TAP3, TAP2, TAP1, TAP0, TAP1, TAP2, TAP3, TAP4, TAP5);
    const float complete = sums[0][k] + TAP5 * v;
    [[unroll]] for (int j = 0; j < 9; ++j) sums[j][k] = sums[j + 1][k] + taps[j + 1] * v;
    sums[9][k] = TAP5 * v;
    return complete;
}
