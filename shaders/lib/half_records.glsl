// SPDX-License-Identifier: MIT
// Records of lib/records.glsl for blends in half precision: the plane of (x, y) and the exponent of opacity * w =
// 2^(log2(opacity) - x^2 - y^2) as halves, which are evaluated for a pair of pixels at a time; colours as floats. The
// pixels k and k + PIXELS/2 of a thread form a pair, four rows apart. For LOG_FORM alone, and for subgroups of 4 to 32
// lanes. Offsets from the block's centre are exact in half precision. Forward and backward blend get the same alpha,
// because every operation here is one that rounds once.
// Needs what lib/records.glsl needs.

const uint HALF_RECORD = 2u;  // uvec4s per record
shared uvec4 half_records[RECORDS * HALF_RECORD];

uint half_records_base() {
    return gl_SubgroupID * (RECORDS / AREAS) * HALF_RECORD;
}

struct HalfRecord {
    f16vec2 centre;  // (x, y) at the area's centre
    f16vec2 l1;      // l11, l21
    f16vec2 l2;      // l22, log2(opacity)
    vec3 colour;
    float depth;  // with DEPTH_SUM
    uint number;  // 1 + the intersection
};

uint packed_half(vec2 v) {
    return packFloat2x16(f16vec2(v));
}

void store_half_record(uint at, Record r) {
    half_records[at] = uvec4(packed_half(r.centre), packed_half(vec2(r.l11, r.l21)),
                             packed_half(vec2(r.l22, r.strength)), r.number);
    half_records[at + 1u] = floatBitsToUint(vec4(r.colour, r.depth));
}

HalfRecord load_half_record(uint at) {
    const uvec4 a = half_records[at];
    const vec4 b = uintBitsToFloat(half_records[at + 1u]);
    return HalfRecord(unpackFloat2x16(a.x), unpackFloat2x16(a.y), unpackFloat2x16(a.z), b.rgb, b.a, a.w);
}

// opacity * w of a pair before any limit; offset: that of its upper pixel.
vec2 half_pair_alpha(HalfRecord r, vec2 offset) {
    const f16vec2 i = f16vec2(float16_t(offset.x)), j = f16vec2(vec2(offset.y, offset.y + 4.0));
    const f16vec2 x = fma(-r.l1.yy, j, fma(-r.l1.xx, i, r.centre.xx));
    const f16vec2 y = fma(-r.l2.xx, j, r.centre.yy);
    return vec2(exp2(fma(-x, x, fma(-y, y, r.l2.yy))));
}

// The same of all pixels of the thread.
void half_alphas(HalfRecord r, vec2 offset, out float raw[PIXELS]) {
    for (uint k = 0u; k < PIXELS / 2u; ++k) {
        const vec2 pair = half_pair_alpha(r, offset + vec2(slot_offset(k)));
        raw[k] = pair.x;
        raw[k + PIXELS / 2u] = pair.y;
    }
}
