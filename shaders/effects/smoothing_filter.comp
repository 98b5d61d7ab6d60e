// SPDX-License-Identifier: MIT
// The deviation of each splat's 3D smoothing filter: sqrt(0.2) of the smallest pixel footprint, depth over focal
// length, among the cameras that see its centre; 0 where none does.
// Place: in training, every 100 iterations. Source: Mip-Splatting (Yu et al. 2024), section 5.1; as in theirs, a frame
// counts with 15 % around it.
// Work: one thread per splat. Shared memory: none. Reads cameras and positions; writes the filters.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/effect_args.h"
#include "shared/render_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

#include "shared/limits.h"
#include "effects/constants.glsl"
#include "lib/linear_id.glsl"
#include "lib/covariance.glsl"
#include "effects/camera_model.glsl"

layout(push_constant, scalar) uniform Push { SmoothingArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Cameras { CameraData cameras[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Position { vec3 position[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Smoothing { float smoothing[]; };

const float FILTER_VARIANCE = 0.2;  // square pixels
const float FRAME_MARGIN = 0.15;    // share of width and height, on each side

void main() {
    const uint i = linear_id();
    if (i >= args.splat_count) return;
    float least = 1e30;
    for (uint c = 0u; c < args.camera_count; ++c) {
        const CameraData camera = cameras[c];
        const vec3 p = to_camera(camera, from_centre(camera, position[i]));
        vec2 pixel;
        if (!(p.z > camera.near_plane) || !pixel_of(camera, p, pixel)) continue;
        const vec2 size = vec2(camera.width, camera.height);
        if (any(lessThan(pixel, -FRAME_MARGIN * size)) || any(greaterThan(pixel, (1.0 + FRAME_MARGIN) * size)))
            continue;
        least = min(least, p.z / max(camera.focal.x, camera.focal.y));
    }
    smoothing[i] = least < 1e30 ? sqrt(FILTER_VARIANCE) * least : 0.0;
}
