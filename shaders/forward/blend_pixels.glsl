// SPDX-License-Identifier: MIT
// The pixels of a thread in the forward blends, and how one sample is blended into one of them. Needs
// forward/blend_interface.glsl.

struct Pixels {
    float transmittance[PIXELS];  // negative once the pixel has ended
    vec3 colour[PIXELS];
    uint last[PIXELS];  // 1 + the last intersection that was looked at before the pixel ended; 0: none
};

// The light of the current bucket. It is not a part of Pixels, so that nothing of it remains without checkpoints. The
// same holds for depths.
const uint BUCKET_COLOURS = CHECKPOINTS == 1 ? PIXELS : 1u;
vec3 bucket_colour[BUCKET_COLOURS];
const uint DEPTHS = DEPTH_SUM == 1 ? PIXELS : 1u, BUCKET_DEPTHS = CHECKPOINTS == 1 ? DEPTHS : 1u;
float depth_sum[DEPTHS], bucket_depth[BUCKET_DEPTHS];
const uint SPREADS = DEPTH_SPREAD == 1 ? PIXELS : 1u, BUCKET_SPREADS = CHECKPOINTS == 1 ? SPREADS : 1u;
float square_sum[SPREADS], bucket_square[BUCKET_SPREADS], first_depth[SPREADS];

void clear_depths(uint k) {
    if (DEPTH_SUM == 1) depth_sum[k] = 0.0;
    if (DEPTH_SUM == 1 && CHECKPOINTS == 1) bucket_depth[k] = 0.0;
    if (DEPTH_SPREAD == 1) square_sum[k] = first_depth[k] = 0.0;
    if (DEPTH_SPREAD == 1 && CHECKPOINTS == 1) bucket_square[k] = 0.0;
}

vec3 load_depth(uint splat) {  // z and its slope
    const vec4 bound = splat_bound[splat];
    return vec3(bound.z, unpackHalf2x16(floatBitsToUint(bound.w)));
}

void blend_sample(inout Pixels px, uint k, float alpha, vec3 colour, float depth, uint number) {
    const float before = px.transmittance[k];
    const float wanted = alpha * before;
    const float next = before - wanted;
    const bool goes_on = next >= MIN_TRANSMITTANCE;  // false for a pixel that has ended
    px.colour[k] += (goes_on ? wanted : 0.0) * colour;
    if (CHECKPOINTS == 1) bucket_colour[k] += (goes_on ? wanted : 0.0) * colour;
    if (DEPTH_SPREAD == 1) {
        first_depth[k] = before == 1.0 ? depth : first_depth[k];  // no splat before this one counted
        depth -= first_depth[k];
        const float square = (goes_on ? wanted : 0.0) * (depth * depth);
        square_sum[k] += square;
        if (CHECKPOINTS == 1) bucket_square[k] += square;
    }
    if (DEPTH_SUM == 1) depth_sum[k] += (goes_on ? wanted : 0.0) * depth;
    if (DEPTH_SUM == 1 && CHECKPOINTS == 1) bucket_depth[k] += (goes_on ? wanted : 0.0) * depth;
    px.transmittance[k] = mix(-abs(before), next, goes_on);
    if (STORE_FOR_BACKWARD == 1) px.last[k] = goes_on ? number : px.last[k];
}
