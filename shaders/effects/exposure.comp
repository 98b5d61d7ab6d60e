// Maps the colours of a picture by its photo's exposure, an affine 3 x 4 matrix. Place: between blend and loss, in
// training alone. Source: per-image exposure of 3DGS (2024) and of NeRF in the Wild's affine form.
// Work: one thread a pixel. Shared memory: none. Reads the picture and the maps; writes the mapped picture.
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

void main() {
    const uint p = linear_id();
    if (p >= args.pixels) return;
    const uint m = args.view * EXPOSURE_TERMS;
    const float r = image[p], g = image[args.pixels + p], b = image[2u * args.pixels + p];
    for (uint c = 0u; c < 3u; ++c) {
        const uint row = m + 4u * c;
        mapped[c * args.pixels + p] = maps[row] * r + maps[row + 1u] * g + maps[row + 2u] * b + maps[row + 3u];
    }
}
