// SPDX-License-Identifier: MIT
// The resorting window of DEPTH_ORDER_PIXEL: a pixel holds back the last WINDOW samples, sorted by their depth at the
// pixel, and blends the nearest when another one comes. Source: the last level of StopThePop (Radl et al. 2024). The
// depth at a pixel is the mean of the splat's depth there, z - slope . (x, y), which is exact for the affine
// projection; (x, y) is the whitened offset.
#include "lib/depth.glsl"

const uint WINDOW = DEPTH_ORDER == DEPTH_ORDER_PIXEL ? DEPTH_WINDOW : 1u;
const float NO_DEPTH = -3e38;  // depth of an empty place, which comes out first and has no alpha

// Private to the thread, [WINDOW][PIXELS]. They are not parameters, because some compilers would copy those at every
// call.
float window_depth[WINDOW * PIXELS];
vec4 window_light[WINDOW * PIXELS];  // colour, alpha

void clear_window(uint k) {
    for (uint i = 0u; i < WINDOW; ++i) {
        window_depth[i * PIXELS + k] = NO_DEPTH;
        window_light[i * PIXELS + k] = vec4(0.0);
    }
}

// Puts a sample in its place in the window of pixel k and returns the light of the nearest of them all.
vec4 exchange_nearest(uint k, float depth, vec4 light) {
    for (uint i = WINDOW; i > 0u; --i) {
        const uint at = (i - 1u) * PIXELS + k;
        const float held_depth = window_depth[at];
        const vec4 held_light = window_light[at];
        const bool farther = depth >= held_depth;  // equal depths keep the order of the list
        window_depth[at] = farther ? depth : held_depth;
        window_light[at] = farther ? light : held_light;
        depth = farther ? held_depth : depth;
        light = farther ? held_light : light;
    }
    return light;
}
