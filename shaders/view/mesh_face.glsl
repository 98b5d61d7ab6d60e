// SPDX-License-Identifier: MIT
// A face of a mesh as a pinhole sees it. Whether it covers a pixel follows from the planes through the eye and its
// sides, so nothing needs to be clipped. Needs MeshDrawArgs as `args`; binds the mesh at 0 and 1.
layout(set = 0, binding = 0, scalar) readonly buffer Position { vec3 position[]; };  // [V]
layout(set = 0, binding = 1, scalar) readonly buffer Faces { uvec3 faces[]; };       // [F]

const uint NO_FACE = 0xFFFFFFFFu;
const uint NO_SURFACE = 0x7F800000u;  // infinity

// corner: in the camera's frame; side[i]: at right angles to the plane through the eye and the side opposite corner i;
// normal: their sum, twice the area in length.
struct Face {
    vec3 corner[3], side[3];
    vec3 normal;
};

vec3 in_camera(uint vertex) {
    const vec3 p = position[vertex];
    return vec3(dot(args.row0, p), dot(args.row1, p), dot(args.row2, p)) + args.shift;
}

Face load_face(uint id) {
    const uvec3 of = faces[id];
    Face f;
    f.corner = vec3[](in_camera(of.x), in_camera(of.y), in_camera(of.z));
    // Products of a corner with a difference lose no digits where the face is small and far away.
    for (uint i = 0u; i < 3u; ++i) {
        const vec3 from = f.corner[(i + 1u) % 3u];
        f.side[i] = cross(from, f.corner[(i + 2u) % 3u] - from);
    }
    f.normal = cross(f.corner[1] - f.corner[0], f.corner[2] - f.corner[0]);
    return f;
}

vec3 ray_of(uvec2 pixel) {
    return vec3((vec2(pixel) + 0.5 - args.principal) / args.focal, 1.0);
}

// The depth at which the ray meets the face; 0: it does not, or before the near plane. weights: of the corners.
float depth_on(Face f, vec3 ray, out vec3 weights) {
    // A ray along a shared side must not miss both faces by rounding.
    const float slack = 2e-6;
    const float facing = dot(f.normal, ray), way = facing < 0.0 ? -1.0 : 1.0;
    bool hit = facing != 0.0;
    for (int i = 0; i < 3; ++i) {
        weights[i] = way * dot(f.side[i], ray);
        hit = hit && weights[i] >= -slack * length(f.side[i]);
    }
    const float depth = dot(f.normal, f.corner[0]) / facing;
    return hit && depth >= args.near_plane ? depth : 0.0;
}

// The pixels whose middles the face may cover, [first, end); false where there are none.
bool pixels_of(Face f, out uvec2 first, out uvec2 end) {
    vec2 low = vec2(3e38), high = vec2(-3e38);
    for (uint i = 0u; i < 3u; ++i) {
        const vec3 a = f.corner[i], b = f.corner[(i + 1u) % 3u];
        const bool ahead = a.z >= args.near_plane;
        if (ahead) {
            const vec2 at = a.xy / a.z * args.focal + args.principal;
            low = min(low, at);
            high = max(high, at);
        }
        if (ahead == (b.z >= args.near_plane)) continue;
        const vec3 cut = mix(a, b, (args.near_plane - a.z) / (b.z - a.z));
        const vec2 at = cut.xy / args.near_plane * args.focal + args.principal;
        low = min(low, at);
        high = max(high, at);
    }
    const vec2 size = vec2(args.width, args.height);
    first = uvec2(clamp(ceil(low - 0.51), vec2(0.0), size));
    end = uvec2(clamp(floor(high - 0.49) + 1.0, vec2(0.0), size));
    return first.x < end.x && first.y < end.y;
}
