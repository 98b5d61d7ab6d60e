// SPDX-License-Identifier: MIT
// Loads and stores the pixels of a thread from and to the outputs. Needs forward/blend_pixels.glsl.

// The state that the previous dispatch left.
void load(inout Pixels px, uvec2 first) {
    const uint plane = args.width * args.height;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        if (at.x >= args.width || at.y >= args.height) continue;
        const uint o = at.y * args.width + at.x;
        px.transmittance[k] = final_transmittance[o];
        px.colour[k] = vec3(image[o], image[plane + o], image[2u * plane + o]);
        if (DEPTH_SUM == 1) depth_sum[k] = image[DEPTH_PLANE * plane + o];
        if (DEPTH_SPREAD == 1) {
            square_sum[k] = image[SQUARE_PLANE * plane + o];
            first_depth[k] = image[FIRST_DEPTH_PLANE * plane + o];
        }
        if (STORE_FOR_BACKWARD == 1) px.last[k] = last_intersection[o];
    }
}

void store(Pixels px, uvec2 first) {
    const bool more = SEGMENT > 0u && args.segment + 1u < args.segments;
    const vec3 background =
        more ? vec3(0.0) : vec3(args.background_r, args.background_g, args.background_b);
    const uint plane = args.width * args.height;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        if (at.x >= args.width || at.y >= args.height) continue;
        const uint o = at.y * args.width + at.x;
        const float transmittance = abs(px.transmittance[k]);
        const vec3 colour = px.colour[k] + transmittance * background;
        image[o] = colour.r;
        image[plane + o] = colour.g;
        image[2u * plane + o] = colour.b;
        if (DEPTH_SUM == 1) image[DEPTH_PLANE * plane + o] = depth_sum[k];
        if (DEPTH_SPREAD == 1) {
            image[SQUARE_PLANE * plane + o] = square_sum[k];
            image[FIRST_DEPTH_PLANE * plane + o] = first_depth[k];
        }
        if (STORE_FOR_BACKWARD == 1) last_intersection[o] = px.last[k];
        if (STORE_FOR_BACKWARD == 1 || SEGMENT > 0u)
            final_transmittance[o] = more ? px.transmittance[k] : transmittance;
    }
}
