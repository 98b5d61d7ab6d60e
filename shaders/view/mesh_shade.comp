// SPDX-License-Identifier: MIT
// The colours of the faces that the rasters of a mesh found, as 8-bit pixels; the background where there are none.
// Place: after mesh_raster_large.comp. Work: a thread a pixel. Shared memory: none. Reads the mesh, its colours and the
// face of each pixel; writes B8G8R8A8.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/view_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

layout(push_constant, scalar) uniform Push { MeshDrawArgs args; };
layout(set = 0, binding = 2, scalar) readonly buffer FaceOf { uint mesh_face[]; };  // [H][W]
layout(set = 0, binding = 3, scalar) readonly buffer Colour { uint colour[]; };     // [V] R in the low byte
layout(set = 0, binding = 4, scalar) writeonly buffer Pixels { uint pixels[]; };

#include "lib/linear_id.glsl"
#include "view/mesh_face.glsl"

// Light from the eye, and more from above its left shoulder; faces have no back.
vec3 shape_of(Face f, vec3 ray) {
    const vec3 toward = -normalize(ray), above = normalize(vec3(-0.5, -0.8, -0.6));
    vec3 normal = normalize(f.normal);
    if (dot(normal, toward) < 0.0) normal = -normal;
    const float light = 0.12 + 0.33 * dot(normal, toward) + 0.5 * max(dot(normal, above), 0.0);
    return vec3(0.93, 0.95, 1.0) * light;
}

// The share of a pixel that the nearest side of the face darkens, as if it were a line. It fades where the face is
// hardly wider than its lines, as these would leave nothing else.
float edge_at(Face f, vec3 ray) {
    float nearest = 3e38, width = 3e38;  // px; width: the least height of the face
    for (uint i = 0u; i < 3u; ++i) {
        const float slope = max(length(f.side[i].xy / args.focal), 1e-30);
        nearest = min(nearest, abs(dot(f.side[i], ray)) / slope);
        const vec3 corner = f.corner[i] / max(f.corner[i].z, args.near_plane);
        width = min(width, abs(dot(f.side[i], corner)) / slope);
    }
    return clamp(1.25 - nearest, 0.0, 1.0) * clamp((width - 2.0) / 8.0, 0.0, 1.0);
}

void main() {
    const uint i = linear_id();
    if (i >= args.width * args.height) return;
    vec3 shown = vec3(args.background_r, args.background_g, args.background_b);
    const uint id = mesh_face[i];
    if (id != NO_FACE) {
        const vec3 ray = ray_of(uvec2(i % args.width, i / args.width));
        const Face f = load_face(id);
        if (args.look == MESH_COLOURS && args.has_colours == 1u) {
            vec3 weights;
            depth_on(f, ray, weights);
            weights = max(weights, 0.0) / max(weights.x + weights.y + weights.z, 1e-37);
            const uvec3 of = faces[id];
            shown = unpackUnorm4x8(colour[of.x]).rgb * weights.x + unpackUnorm4x8(colour[of.y]).rgb * weights.y +
                    unpackUnorm4x8(colour[of.z]).rgb * weights.z;
        } else {
            shown = shape_of(f, ray);
            if (args.look == MESH_EDGES) shown = mix(shown, vec3(0.05, 0.2, 0.45), 0.8 * edge_at(f, ray));
        }
    }
    pixels[i] = packUnorm4x8(vec4(shown.bgr, 1.0));
}
