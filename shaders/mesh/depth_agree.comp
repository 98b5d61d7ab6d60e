// SPDX-License-Identifier: MIT
// Keeps the depths of a view that other views confirm: the point of a pixel, seen from another view, must lie on that
// view's surface to AGREE_SHARE of its depth. Source: the fusion of depth maps in engine/stereo.
// Place: after the depths of all views, before they are fused. Work: one thread a pixel of the first view. Shared memory:
// none. Reads the depths of that view and of those it is compared with; writes its own, 0 where they disagree.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/mesh_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = MESH_GROUP;

layout(push_constant, scalar) uniform Push { AgreeArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Views { MeshView views[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Depths { float depths[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Kept { float kept[]; };  // [H][W] of the first view

#include "lib/linear_id.glsl"
#include "lib/covariance.glsl"
#include "lib/depth_view.glsl"

// Whether one of the pixels around shows the point, or the surface between them. hidden: all of them show something
// before it, so that the view says nothing of the point.
bool confirms(MeshView view, vec2 pixel, float z, out bool hidden) {
    vec2 share;
    const vec4 d = depths_around(view, pixel, share);
    hidden = least_of(d) > 0.0 && most_of(d) < z - AGREE_SHARE * z;
    if (one_surface(d) && z >= least_of(d) && z <= most_of(d)) return true;
    return any(lessThanEqual(abs(d - z), vec4(AGREE_SHARE * z)));
}

void main() {
    const MeshView view = views[0];
    const uint i = linear_id();
    if (i >= view.camera.width * view.camera.height) return;
    const float z = depths[view.first + i];
    kept[i] = 0.0;
    if (!(z > 0.0)) return;
    const vec2 at = vec2(i % view.camera.width, i / view.camera.width) + 0.5;
    const vec3 ray = vec3((at - view.camera.principal) / view.camera.focal, 1.0);
    const vec3 p = (view.camera.centre + to_world(view.camera, ray * z)) + view.camera.centre_rest;
    uint looks = 0u, agrees = 0u;
    for (uint v = 1u; v <= args.others; ++v) {
        vec2 pixel;
        float other;
        if (!place_in_view(views[v], p, pixel, other)) continue;
        bool hidden;
        const bool confirmed = confirms(views[v], pixel, other, hidden);
        if (!hidden) ++looks;
        if (confirmed) ++agrees;
    }
    if (looks > 0u && agrees >= min(args.least, looks)) kept[i] = z;
}
