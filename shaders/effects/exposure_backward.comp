// SPDX-License-Identifier: MIT
// The gradient of exposure.comp. d_image becomes the gradient of the picture before the map, and every group sums the
// map's own gradient, the same in every run. The covered share of a pixel scales the map's offset, which the picture's
// gradient does not show: that part goes to the plane dL/d(1 - transmittance).
// Place: between loss and blend_backward.
// Work: groups of EXPOSURE_THREADS walk over the pixels in strides. Shared memory: 12 floats per thread, added up by
// one thread per term; as a tree with a barrier for each level, the pass takes 3.5 times as long on a CPU. Reads the
// picture before the map, transmittance and d_image; writes d_image and partial sums [groups][12].
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/effect_args.h"

layout(local_size_x = EXPOSURE_THREADS) in;

layout(push_constant, scalar) uniform Push { ExposureArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Maps { float maps[]; };
layout(set = 0, binding = 1, scalar) readonly buffer ImageIn { float image[]; };
layout(set = 0, binding = 2, scalar) buffer Gradient { float d_image[]; };  // [4][H W], the last plane written
layout(set = 0, binding = 3, scalar) writeonly buffer Partials { float partials[]; };
layout(set = 0, binding = 4, scalar) readonly buffer FinalT { float final_transmittance[]; };

#include "effects/covered.glsl"

shared float sums[EXPOSURE_THREADS][EXPOSURE_TERMS];

void main() {
    const uint m = args.view * EXPOSURE_TERMS, lane = gl_LocalInvocationID.x;
    float map[EXPOSURE_TERMS], sum[EXPOSURE_TERMS];
    for (uint k = 0u; k < EXPOSURE_TERMS; ++k) {
        map[k] = maps[m + k];
        sum[k] = 0.0;
    }
    for (uint p = gl_WorkGroupID.x * EXPOSURE_THREADS + lane; p < args.pixels; p += args.groups * EXPOSURE_THREADS) {
        const vec4 colour = covered_colour(p);
        const vec3 d = vec3(d_image[p], d_image[args.pixels + p], d_image[2u * args.pixels + p]);
        for (uint c = 0u; c < 3u; ++c) {
            for (uint k = 0u; k < 4u; ++k) sum[4u * c + k] += d[c] * colour[k];
        }
        vec3 before;
        for (uint c = 0u; c < 3u; ++c) {
            before[c] = map[c] * d.x + map[4u + c] * d.y + map[8u + c] * d.z;
            d_image[c * args.pixels + p] = before[c];
        }
        // A larger share of the splats means more of the offset and less of the unmapped background; the gradient
        // before the map treats the background as if it were mapped.
        const vec3 offset = vec3(map[3], map[7], map[11]);
        d_image[3u * args.pixels + p] = dot(before - d, background()) + dot(d, offset);
    }
    for (uint k = 0u; k < EXPOSURE_TERMS; ++k) sums[lane][k] = sum[k];
    barrier();
    if (lane >= EXPOSURE_TERMS) return;
    float total = 0.0;
    for (uint i = 0u; i < EXPOSURE_THREADS; ++i) total += sums[i][lane];
    partials[gl_WorkGroupID.x * EXPOSURE_TERMS + lane] = total;
}
