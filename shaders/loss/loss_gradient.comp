// SPDX-License-Identifier: MIT
// The second of two passes of the loss by tiles. It blurs the derivatives that loss_maps.comp left and makes the
// gradient from them, in the order of loss.comp: across first, then row by row.
// Work: one workgroup per tile of one channel, one thread per pixel. Reads image, photo and maps; writes d_image.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require

#include "shared/loss_args.h"

layout(local_size_x = LOSS_TILE * LOSS_TILE) in;
layout(constant_id = 0) const int USE_MASK = 0;  // as in loss.comp
layout(constant_id = 1) const int USE_ALPHA = 1;

layout(push_constant, scalar) uniform Push { LossArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer ImageIn { float image[]; };         // [3][H][W]
layout(set = 0, binding = 1, scalar) readonly buffer PhotoIn { uint photo[]; };          // [H][W] R G B A
layout(set = 0, binding = 2, scalar) readonly buffer MapsIn { float maps[]; };           // [3][H][W][3]
layout(set = 0, binding = 3, scalar) writeonly buffer GradientOut { float d_image[]; };  // [3][H][W]

#include "loss/pixel.glsl"
#include "loss/tile.glsl"
#include "loss/window.glsl"

// One plane for each: three words per pixel take less than the 16 KiB that every device has.
shared float d[3][LOSS_SIDE * LOSS_SIDE];
shared float across[3][LOSS_SIDE * LOSS_TILE];

float blur_across(int map, int x, int y) {
    const int at = y * LOSS_SIDE + x + 5;
    return blur(d[map][at], d[map][at - 1] + d[map][at + 1], d[map][at - 2] + d[map][at + 2],
                d[map][at - 3] + d[map][at + 3], d[map][at - 4] + d[map][at + 4], d[map][at - 5] + d[map][at + 5]);
}

// The blur of column x over the 11 rows from row y on.
float blur_down(int map, int x, int y) {
    const float taps[11] = float[](TAP5, TAP4, TAP3, TAP2, TAP1, TAP0, TAP1, TAP2, TAP3, TAP4, TAP5);
    float sum = TAP5 * across[map][y * LOSS_TILE + x];
    [[unroll]] for (int j = 1; j < 11; ++j) sum += taps[j] * across[map][(y + j) * LOSS_TILE + x];
    return sum;
}

void main() {
    const Tile tile = tile_of();
    const int thread = int(gl_LocalInvocationIndex);
    const uint plane = uint(tile.channel) * args.width * args.height;
    for (int i = thread; i < LOSS_SIDE * LOSS_SIDE; i += LOSS_TILE * LOSS_TILE) {
        const int column = tile.left - 5 + i % LOSS_SIDE, row = tile.top - 5 + i / LOSS_SIDE;
        const bool inside = in_image(column, row);
        const uint map = inside ? 3u * (plane + uint(row) * args.width + uint(column)) : 0u;
        [[unroll]] for (int m = 0; m < 3; ++m) d[m][i] = inside ? maps[map + uint(m)] : 0.0;
    }
    barrier();
    for (int i = thread; i < LOSS_SIDE * LOSS_TILE; i += LOSS_TILE * LOSS_TILE)
        [[unroll]] for (int m = 0; m < 3; ++m) across[m][i] = blur_across(m, i % LOSS_TILE, i / LOSS_TILE);
    barrier();
    const int x = thread % LOSS_TILE, y = thread / LOSS_TILE;
    const int column = tile.left + x, row = tile.top + y;
    if (!in_image(column, row)) return;
    const vec2 ab = sum_and_difference(tile.channel, column, row);
    const float g = blur_down(0, x, y) + ab.x * blur_down(1, x, y) + ab.y * blur_down(2, x, y);
    const uint at = uint(row) * args.width + uint(column);
    d_image[plane + at] = is_compared(at) ? args.l1_scale * sign(ab.y) + args.ssim_scale * g : 0.0;
}
