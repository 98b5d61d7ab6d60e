// SPDX-License-Identifier: MIT
// Maps the colours of a picture by its photo's exposure, an affine 3 x 4 matrix. It maps the light of the splats alone,
// as if each splat's colour were mapped; the background is in no photo and stays as it is.
// Place: between blend and loss, only in training. Source: the per-image exposure of 3DGS (2024), and the affine form
// of NeRF in the Wild.
// Work: one thread per pixel. Shared memory: none. Reads picture, transmittance and maps; writes the mapped picture.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/effect_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "lib/linear_id.glsl"

layout(push_constant, scalar) uniform Push { ExposureArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Maps { float maps[]; };          // [views][12]
layout(set = 0, binding = 1, scalar) readonly buffer ImageIn { float image[]; };      // [3][H W]
layout(set = 0, binding = 2, scalar) writeonly buffer ImageOut { float mapped[]; };   // [3][H W]
layout(set = 0, binding = 3, scalar) readonly buffer FinalT { float final_transmittance[]; };  // [H W]

#include "effects/covered.glsl"

void main() {
    const uint p = linear_id();
    if (p >= args.pixels) return;
    const uint m = args.view * EXPOSURE_TERMS;
    const vec4 covered = covered_colour(p);
    const vec3 through = final_transmittance[p] * background();
    for (uint c = 0u; c < 3u; ++c) {
        const uint row = m + 4u * c;
        mapped[c * args.pixels + p] =
            dot(vec4(maps[row], maps[row + 1u], maps[row + 2u], maps[row + 3u]), covered) + through[c];
    }
}
