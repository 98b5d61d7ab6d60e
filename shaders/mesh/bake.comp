// SPDX-License-Identifier: MIT
// Colours of vertices: each asks each view whether it is on the surface that the view shows there, and takes the mean of
// the pictures' colours with the weight cos^2/z^2. Where no view shows it, those that have the place in their picture
// decide, with a weight a million times less.
// Place: last, on the cleaned mesh. Work: one thread a vertex; views in order. Shared memory: none. Reads views, depths,
// colours and vertices; reads and writes the sums.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/mesh_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = MESH_GROUP;

layout(push_constant, scalar) uniform Push { BakeArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Views { MeshView views[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Depths { float depths[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Colours { uint colours[]; };  // RGBA, 8 bits each
layout(set = 0, binding = 3, scalar) readonly buffer Vertices { vec3 vertices[]; };
layout(set = 0, binding = 4, scalar) buffer Sums { vec4 sums[]; };  // [V] weighted colour, weight

#include "lib/linear_id.glsl"
#include "lib/covariance.glsl"
#include "lib/depth_view.glsl"

const float HIDDEN = 1e-6;

vec3 colour_at(MeshView view, vec2 pixel) {
    const vec2 last = vec2(view.camera.width, view.camera.height) - 1.0;
    const vec2 at = clamp(pixel - 0.5, vec2(0.0), last), low = floor(at), share = at - low;
    const uvec2 a = uvec2(low), b = min(a + 1u, uvec2(last));
    vec3 row[2];
    for (uint y = 0u; y < 2u; ++y) {
        const uint from = view.first + (y == 0u ? a.y : b.y) * view.camera.width;
        row[y] = mix(unpackUnorm4x8(colours[from + a.x]).rgb, unpackUnorm4x8(colours[from + b.x]).rgb, share.x);
    }
    return mix(row[0], row[1], share.y);
}

void main() {
    const uint i = linear_id();
    if (i >= args.vertices) return;
    const vec3 p = vertices[i];
    vec4 sum = sums[i];
    for (uint v = 0u; v < args.views; ++v) {
        vec2 pixel;
        float z, cosine;
        if (!place_in_view(views[v], p, pixel, z)) continue;
        const float surface = surface_depth(views[v], pixel, cosine);
        const bool shown = surface > 0.0 && abs(surface - z) <= args.tolerance;
        sum += (shown ? cosine * cosine : HIDDEN) / (z * z) * vec4(colour_at(views[v], pixel), 1.0);
    }
    sums[i] = sum;
}
