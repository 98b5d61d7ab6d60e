// SPDX-License-Identifier: MIT
// The pixels of a thread in the backward blends that walk lists. Needs their bindings, lib/area.glsl and
// lib/depth_sum.glsl.

#include "backward/depth_gradient.glsl"

struct Pixels {
    float transmittance[PIXELS];
    float behind[PIXELS];
    vec3 d_colour[PIXELS];
    uint last[PIXELS];
};

// One for each pixel with DEPTH_SUM. The array is separate, so that nothing of it remains without DEPTH_SUM.
const uint DEPTHS = DEPTH_SUM == 1 ? PIXELS : 1u;
vec3 d_depth[DEPTHS];

uint load_pixels(uvec2 first, out Pixels px) {
    const vec3 background = vec3(args.background_r, args.background_g, args.background_b);
    const uint plane = args.width * args.height;
    uint last = 0u;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        px.d_colour[k] = vec3(0.0);
        px.behind[k] = 0.0;
        px.transmittance[k] = 1.0;
        px.last[k] = 0u;
        if (DEPTH_SUM == 1) d_depth[k] = vec3(0.0);
        if (at.x < args.width && at.y < args.height) {
            const uint o = at.y * args.width + at.x;
            px.d_colour[k] = vec3(d_image[o], d_image[plane + o], d_image[2u * plane + o]);
            px.transmittance[k] = final_transmittance[o];
            px.last[k] = last_intersection[o];
            if (ALPHA_GRADIENT == 1) px.behind[k] = -d_image[3u * plane + o];
            if (DEPTH_SUM == 1) d_depth[k] = load_depth_gradient(plane, o);
        }
        px.behind[k] += dot(px.d_colour[k], background);
        last = max(last, px.last[k]);
    }
    return last;
}
