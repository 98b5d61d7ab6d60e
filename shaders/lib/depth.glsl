// SPDX-License-Identifier: MIT
// The depth order of the splats, and the keys by which they are sorted.
#ifndef DARB_DEPTH_GLSL
#define DARB_DEPTH_GLSL

#include "shared/accuracy_list.h"

layout(constant_id = 141) const int DEPTH_ORDER = DEPTH_ORDER_CENTRE;

// Positive floats sort as their bits.
uint sort_key(float depth, float near_plane) {
    const uint bits = floatBitsToUint(depth);
    if (DEPTH_ORDER != DEPTH_ORDER_CENTRE16) return bits;
    return min((bits - floatBitsToUint(near_plane)) >> DEPTH_KEY_SHIFT, (1u << DEPTH_KEY_BITS) - 1u);
}

// The same order from the near plane on, before which there are no depths.
uint short_sort_key(float depth, float near_plane) {
    return floatBitsToUint(depth) - floatBitsToUint(max(near_plane, 0.0));
}

#endif
