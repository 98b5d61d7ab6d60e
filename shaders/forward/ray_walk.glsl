// SPDX-License-Identifier: MIT
// A walk over a list that asks what its splats leave of the light at SAMPLES depths of each of the thread's PIXELS rays.
// Needs forward/ray_slice.glsl.
layout(constant_id = 7) const uint SAMPLES = 4;

struct Rays {
    vec2 centre[PIXELS];
    uint end[PIXELS];                   // the splats of the list from there on leave all
    float first[PIXELS], step[PIXELS];  // depths of the samples
    float left[PIXELS * SAMPLES];       // T
};

void light_left(inout Rays px, RaySplat s) {
    const float sharpness = 1.0 / s.plane.z;
    [[unroll]] for (uint k = 0u; k < PIXELS; ++k) {
        const Slice slice = slice_of(s, px.centre[k]);
        const float alpha = s.number < px.end[k] ? slice.alpha : 0.0;
        if (READING == DEPTH_READING_PLANE) {
            [[unroll]] for (uint i = 0u; i < SAMPLES; ++i)
                px.left[k * SAMPLES + i] *= px.first[k] + float(i) * px.step[k] >= slice.mean ? 1.0 - alpha : 1.0;
            continue;
        }
        const float strength = alpha / slice.w;
        const float t = (px.first[k] - slice.mean) * sharpness, step = px.step[k] * sharpness;
        [[unroll]] for (uint i = 0u; i < SAMPLES; ++i) {
            const float at = t + float(i) * step;
            const float ahead = READING == DEPTH_READING_FRONT ? min(at, 0.0) : at;
            const float a = min(strength * kernel_value(slice.q + ahead * ahead, s.exponent), alpha);
            const float taken = a >= ALPHA_CUTOFF ? a : 0.0;
            float factor = 1.0 - (READING == DEPTH_READING_FRONT && at >= 0.0 ? alpha : taken);
            if (READING == DEPTH_READING_SOLID) {
                factor = sqrt(factor);
                if (at >= 0.0) factor = (1.0 - alpha) / factor;
            }
            px.left[k * SAMPLES + i] *= factor;
        }
    }
}

void walk(inout Rays px, uvec2 range, uint bits) {
    uint chunk = range.x;
    do {
        const uint count = collect_hits(chunk, min(chunk + CHUNK, range.y), bits);
        uint batch = 0u;
        if (count > 0u) do {
            const RaySplat mine = load_hit(min(batch + gl_SubgroupInvocationID, count - 1u));
            const uint end = min(SUBGROUP_SIZE, count - batch);
            uint lane = 0u;
            do {
                light_left(px, broadcast_hit(mine, lane));
            } while (++lane < end);
            batch += SUBGROUP_SIZE;
        } while (batch < count);
        chunk += CHUNK;
    } while (chunk < range.y);
}
