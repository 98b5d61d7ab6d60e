// SPDX-License-Identifier: MIT
// The first of two passes of the loss by tiles: SSIM and its derivatives. They are for devices where the strips of
// loss.comp cost more with their 100 values and more per thread. Here a thread holds few values and needs no subgroup
// operations, and the three derivatives of a pixel go through memory. Source and sums are as in loss.comp, with the
// operations in the same order.
// Work: one workgroup per tile of one channel, one thread per pixel. Reads image and photo; writes maps and the tile's
// partial sum.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require

#include "shared/loss_args.h"

layout(local_size_x = LOSS_TILE * LOSS_TILE) in;
layout(constant_id = 0) const int USE_MASK = 0;  // as in loss.comp
layout(constant_id = 1) const int USE_ALPHA = 1;

layout(push_constant, scalar) uniform Push { LossArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer ImageIn { float image[]; };      // [3][H][W]
layout(set = 0, binding = 1, scalar) readonly buffer PhotoIn { uint photo[]; };       // [H][W] R G B A
layout(set = 0, binding = 2, scalar) writeonly buffer MapsOut { float maps[]; };      // [3][H][W][3]
layout(set = 0, binding = 3, scalar) writeonly buffer PartialOut { vec4 partial[]; };  // [works]

#include "loss/pixel.glsl"
#include "loss/tile.glsl"
#include "loss/window.glsl"

shared vec2 ab[LOSS_SIDE * LOSS_SIDE];
shared vec4 down[LOSS_TILE * LOSS_SIDE];  // means of a, b, a^2, b^2 over 11 rows; then the sums

// Column x of the 11 rows from row y on.
vec4 blur_down(int x, int y) {
    vec4 v[11];
    [[unroll]] for (int j = 0; j < 11; ++j) {
        const vec2 one = ab[(y + j) * LOSS_SIDE + x];
        v[j] = vec4(one, one * one);
    }
    return blur(v[5], v[4] + v[6], v[3] + v[7], v[2] + v[8], v[1] + v[9], v[0] + v[10]);
}

vec4 blur_across(int x, int y) {
    const int at = y * LOSS_SIDE + x + 5;
    return blur(down[at], down[at - 1] + down[at + 1], down[at - 2] + down[at + 2], down[at - 3] + down[at + 3],
                down[at - 4] + down[at + 4], down[at - 5] + down[at + 5]);
}

void main() {
    const Tile tile = tile_of();
    const int thread = int(gl_LocalInvocationIndex);
    for (int i = thread; i < LOSS_SIDE * LOSS_SIDE; i += LOSS_TILE * LOSS_TILE)
        ab[i] = sum_and_difference(tile.channel, tile.left - 5 + i % LOSS_SIDE, tile.top - 5 + i / LOSS_SIDE);
    barrier();
    for (int i = thread; i < LOSS_TILE * LOSS_SIDE; i += LOSS_TILE * LOSS_TILE)
        down[i] = blur_down(i % LOSS_SIDE, i / LOSS_SIDE);
    barrier();
    const int x = thread % LOSS_TILE, y = thread / LOSS_TILE;
    const vec4 mean = blur_across(x, y);
    const int column = tile.left + x, row = tile.top + y;
    vec4 sums = vec4(0.0);
    if (in_image(column, row)) {
        const uint at = uint(row) * args.width + uint(column);
        vec3 d;
        const float value = ssim(mean.x, mean.y, mean.z, mean.w, d);
        const uint map = 3u * (uint(tile.channel) * args.width * args.height + at);
        maps[map] = d.x;
        maps[map + 1u] = d.y;
        maps[map + 2u] = d.z;
        if (is_compared(at)) sums = pixel_sums(ab[(y + 5) * LOSS_SIDE + x + 5]);
        sums.y = value;
    }
    barrier();
    down[thread] = sums;
    barrier();
    for (int other = LOSS_TILE * LOSS_TILE / 2; other > 0; other /= 2) {
        if (thread < other) down[thread] += down[thread + other];
        barrier();
    }
    if (thread == 0) partial[tile.work] = down[0];
}
