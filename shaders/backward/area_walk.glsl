// SPDX-License-Identifier: MIT
// A subgroup walks a part of a tile's list from its end over the pixels of an area. blend_backward.comp and
// blend_backward_team.comp share this. Needs their bindings, lib/area.glsl, lib/hits.glsl, backward/splat_sums.glsl,
// splat_exponent, and functions for where the sums of intersection j of the sorted list go: place_of(j), put_sums,
// put_exponent for a kernel with shapes, and put_depth with DEPTH_SUM.

#include "backward/area_pixels.glsl"

Sums splat_sums(inout Pixels px, vec2 d, vec4 shape, vec4 light, float l22, float exponent, float z,
                uint number) {
    Sums s = NO_SUMS;
    for (uint k = 0u; k < PIXELS; ++k) {
        vec3 d_z = vec3(0.0);
        if (DEPTH_SUM == 1) d_z = d_depth[k];
        add_pixel(s, px.transmittance[k], px.behind[k], d - vec2(slot_offset(k)), shape, l22, light, exponent,
                  z, px.d_colour[k], d_z, number <= px.last[k]);
    }
    return s;
}

// Blends the collected splats of an area, of which there is at least one, last to first. centre: of the thread's first
// pixel.
void blend_hits(inout Pixels px, vec2 centre, uint count) {
    uint rest = count;
    do {  // tested at the bottom, as is the inner loop: see emit_cells
        const uint size = min(rest, SUBGROUP_SIZE);
        rest -= size;
        vec4 shape = vec4(0.0), light = vec4(0.0);
        float l22 = 0.0, exponent = 0.0, depth = 0.0;
        uint number = 0u, place = 0u;
        if (gl_SubgroupInvocationID < size) {
            const uint at = hits_base() + rest + gl_SubgroupInvocationID;
            const uint splat = hit_splat[at];
            number = hit_index[at] + 1u;
            place = place_of(hit_index[at]);
            shape = load_shape(splat, l22);
            light = load_light(splat);
            if (SHAPED) exponent = splat_exponent[splat];
            if (DEPTH_SUM == 1) depth = splat_bound[splat].z;
        }
        uint lane = size;
        do {
            --lane;
            const vec4 s = subgroupBroadcast(shape, lane);
            const vec4 c = subgroupBroadcast(light, lane);
            const Sums sums = splat_sums(px, s.xy - centre, s, c, subgroupBroadcast(l22, lane),
                                         SHAPED ? subgroupBroadcast(exponent, lane) : 0.0,
                                         DEPTH_SUM == 1 ? subgroupBroadcast(depth, lane) : 0.0,
                                         subgroupBroadcast(number, lane));
            float parts[PARTIALS] =
                float[](sums.gx * c.w, sums.gxx * c.w, sums.gxdy * c.w, sums.gdy * c.w,
                        sums.opacity, sums.colour.r, sums.colour.g, sums.colour.b);
            put_sums(subgroupBroadcast(place, lane), parts, sums.gdydy * c.w);
            if (SHAPED) put_exponent(subgroupBroadcast(place, lane), sums.exponent * c.w);
            if (DEPTH_SUM == 1) put_depth(subgroupBroadcast(place, lane), sums.depth);
        } while (lane > 0u);
    } while (rest > 0u);
}

#include "backward/area_state.glsl"
