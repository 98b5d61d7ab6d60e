// SPDX-License-Identifier: MIT
// Loads and stores the pixels' state between dispatches, where SEGMENT > 0. Needs backward/area_pixels.glsl.

// What lies behind the intersections of this dispatch comes from, and goes to, the other dispatches.
void load_behind(inout Pixels px, uvec2 first) {
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        if (at.x < args.width && at.y < args.height) px.behind[k] = behind[at.y * args.width + at.x];
    }
}
void store_state(Pixels px, uvec2 first) {
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        if (at.x >= args.width || at.y >= args.height) continue;
        final_transmittance[at.y * args.width + at.x] = px.transmittance[k];
        behind[at.y * args.width + at.x] = px.behind[k];
    }
}
