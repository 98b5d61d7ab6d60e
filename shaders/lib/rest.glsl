// SPDX-License-Identifier: MIT
// The harmonics above the first band of a splat: three columns of four floats hold four coefficients of three channels.
// Needs SH_DEGREE, SH_STORED, sh.glsl and the buffer sh_rest.

#include "lib/rows.glsl"

const int SH_USED = (SH_DEGREE + 1) * (SH_DEGREE + 1) - 1;
const int FOURS = (SH_USED + 3) / 4;  // groups of four coefficients; the last may lack one
const uint COLUMNS = uint((SH_STORED + 1) * (SH_STORED + 1) + 2) / 4u * 3u;

// Loads coefficients 4 t + 1 to 4 t + 4 of splat `row` of the range, rgb.
void load_four(uint row, int t, out vec3 rest[4]) {
    const uint at = column_at(row, 3u * uint(t), COLUMNS);
    const vec4 a = sh_rest[at], b = sh_rest[at + ROW_BLOCK], c = sh_rest[at + 2u * ROW_BLOCK];
    rest = vec3[](a.xyz, vec3(a.w, b.xy), vec3(b.zw, c.x), c.yzw);
}
