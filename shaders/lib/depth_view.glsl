// SPDX-License-Identifier: MIT
// Depths of pinhole views in one buffer: where a point is in a view, and what the view says of the surface there.
// Needs the buffers views (MeshView) and depths, and lib/covariance.glsl for the camera.

// A point in a view: its place in pixels, its depth. False where the view does not have it.
bool place_in_view(MeshView view, vec3 p, out vec2 pixel, out float z) {
    const vec3 c = to_camera(view.camera, from_centre(view.camera, p));
    z = c.z;
    pixel = view.camera.focal * (c.xy / c.z) + view.camera.principal;
    return c.z > view.camera.near_plane && pixel.x >= 0.0 && pixel.y >= 0.0 &&
           pixel.x < float(view.camera.width) && pixel.y < float(view.camera.height);
}

uvec2 nearest_pixel(MeshView view, vec2 pixel) {
    return min(uvec2(pixel), uvec2(view.camera.width, view.camera.height) - 1u);
}

float depth_at(MeshView view, uvec2 pixel) {
    return depths[view.first + pixel.y * view.camera.width + pixel.x];
}

// The four depths whose pixel centres are around a place, rows from the top left; 0 where one is none.
vec4 depths_around(MeshView view, vec2 pixel, out vec2 share) {
    const vec2 last = vec2(view.camera.width, view.camera.height) - 1.0;
    const vec2 at = clamp(pixel - 0.5, vec2(0.0), last), low = min(floor(at), max(last - 1.0, 0.0));
    share = at - low;
    const uvec2 a = uvec2(low), b = min(a + 1u, uvec2(last));
    return vec4(depth_at(view, a), depth_at(view, uvec2(b.x, a.y)), depth_at(view, uvec2(a.x, b.y)), depth_at(view, b));
}

float least_of(vec4 d) { return min(min(d.x, d.y), min(d.z, d.w)); }
float most_of(vec4 d) { return max(max(d.x, d.y), max(d.z, d.w)); }

// Whether all four are there and of one surface.
bool one_surface(vec4 d) {
    const float least = least_of(d);
    return least > 0.0 && most_of(d) - least <= SURFACE_SPREAD * least;
}

// The depth of the surface at a place, 0 where there is none, and the cosine of the angle at which it is seen:
// interpolated on one surface, else the nearest pixel's, seen at a grazing angle.
float surface_depth(MeshView view, vec2 pixel, out float cosine) {
    vec2 share;
    const vec4 d = depths_around(view, pixel, share);
    cosine = 0.05;
    if (!one_surface(d)) return depth_at(view, nearest_pixel(view, pixel));
    const float z = mix(mix(d.x, d.y, share.x), mix(d.z, d.w, share.x), share.y);
    const vec2 slope = vec2(mix(d.y - d.x, d.w - d.z, share.y), mix(d.z - d.x, d.w - d.y, share.x));
    // Along x the surface goes by slope.x (X, Y, 1) + z (1 / f, 0, 0) a pixel, (X, Y, 1) the ray: so the cross product.
    const vec3 ray = vec3((pixel - view.camera.principal) / view.camera.focal, 1.0);
    const vec3 along_x = slope.x * ray + vec3(z / view.camera.focal.x, 0.0, 0.0);
    const vec3 along_y = slope.y * ray + vec3(0.0, z / view.camera.focal.y, 0.0);
    const vec3 normal = cross(along_x, along_y);
    cosine = max(abs(dot(normal, ray)) * inversesqrt(max(dot(normal, normal) * dot(ray, ray), 1e-38)), 0.02);
    return z;
}
