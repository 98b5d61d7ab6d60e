// SPDX-License-Identifier: MIT
// Splats as the lanes of a subgroup share them. Each lane loads one and leaves it in shared memory, from where all
// lanes read it at the same address, 16 bytes at a time: three loads per splat in place of a shuffle for each of its
// numbers. An area is one block here, and positions are relative to its centre, so that (x, y) is linear over its
// pixels, with offsets that are constants of the lane. Nothing cancels but what did so in (x, y) of the centre.
// Needs RECORDS (how many the workgroup has), splat_exponent, kernels/kernel.glsl, lib/projected.glsl, lib/area.glsl
// and lib/depth_sum.glsl.
#include "lib/lockstep.glsl"
#include "lib/log_form.glsl"

const uint RECORD = 3u;  // vec4s per record
shared vec4 records[RECORDS * RECORD];

// Where the subgroup's records begin.
uint records_base() {
    return gl_SubgroupID * (RECORDS / AREAS) * RECORD;
}

struct Record {
    vec2 centre;     // (x, y) at the area's centre
    float l11, l21, l22;
    vec3 colour;
    float strength;  // the opacity; its log2 with LOG_FORM
    float exponent;  // with SHAPED; 1 / opacity with LOG_FORM
    float depth;     // with DEPTH_SUM
    uint number;     // 1 + the intersection
};

// centre: the area's, px.
Record make_record(uint splat, uint number, vec2 centre) {
    Record r;
    const vec4 shape = load_shape(splat, r.l22), light = load_light(splat);
    const vec2 d = shape.xy - centre;
    const float scale = LOG_FORM ? FACTOR_SCALE : 1.0;
    r.l11 = shape.z * scale;
    r.l21 = shape.w * scale;
    r.l22 *= scale;
    r.centre = vec2(r.l11 * d.x + r.l21 * d.y, r.l22 * d.y);
    r.colour = light.rgb;
    r.strength = LOG_FORM ? log2(light.w) : light.w;
    r.exponent = LOG_FORM ? 1.0 / light.w : 0.0;
    if (SHAPED && !LOG_FORM) r.exponent = splat_exponent[splat];
    r.depth = 0.0;
    if (DEPTH_SUM == 1) r.depth = splat_bound[splat].z;
    r.number = number;
    return r;
}

void store_record(uint at, Record r) {
    records[at] = vec4(r.centre, r.l11, r.l21);
    records[at + 1u] = vec4(r.colour, r.strength);
    records[at + 2u] = vec4(r.l22, uintBitsToFloat(r.number), r.exponent, r.depth);
}

Record load_record(uint at) {
    const vec4 a = records[at], b = records[at + 1u], c = records[at + 2u];
    return Record(a.xy, a.z, a.w, c.x, b.rgb, b.w, c.z, c.w, floatBitsToUint(c.y));
}

// The centre of a block, px, and the offset from it of the thread's first pixel there; its others are at +
// slot_offset(k).
vec2 block_centre(uvec2 tile, uint block) {
    return vec2(tile * TILE_SIZE + slot_to_pixel(block * BLOCK_PIXELS)) + 4.0;
}
vec2 first_offset() {
    return vec2(slot_to_pixel(gl_SubgroupInvocationID)) - 3.5;
}

// (x, y) at a pixel.
vec2 whitened(Record r, vec2 offset) {
    return vec2(fma(-r.l21, offset.y, fma(-r.l11, offset.x, r.centre.x)), fma(-r.l22, offset.y, r.centre.y));
}

// opacity * w before any limit. slope is dw/dq; slope, w and by_exponent (dw/d(exponent)) are only set without
// LOG_FORM.
float record_alpha(Record r, vec2 offset, out float w, out float slope, out float by_exponent) {
    const vec2 at = whitened(r, offset);
    w = slope = by_exponent = 0.0;
    if (LOG_FORM) return power_of_log(fma(-at.x, at.x, fma(-at.y, at.y, r.strength)));
    kernel_value_slope(fma(at.x, at.x, at.y * at.y), r.exponent, w, slope, by_exponent);
    return r.strength * w;
}
