// The page's twin of shaders/forward/project.comp: a texel a splat, by the same functions. Writes the mean and the
// Cholesky factor, reach, colour and opacity; zeros for a splat that is not drawn. Where a splat's values stand,
// "stored.glsl" says: words.glsl in a page that holds its splats, sog.glsl in one that fetches them.
#include "shared/render_args.h"
#include "shared/attribute_list.h"

layout(constant_id = 1) const int SH_DEGREE = 0;

#include "effects/constants.glsl"
#include "kernels/kernel.glsl"
#include "lib/sh.glsl"
#include "lib/covariance.glsl"
#include "effects/antialias.glsl"
#include "effects/camera_model.glsl"

uniform CameraData camera;
uniform float low_pass;  // px^2

#include "stored.glsl"

layout(location = 0) out uvec4 splat_shape;  // mean, l11, l21
layout(location = 1) out uvec4 splat_light;  // l22, opacity; rgb and sqrt(reach) as halves
#if PAGE_SHAPED
layout(location = 2) out uint splat_exponent;
#endif

vec3 splat_colour(ivec2 at, vec3 direction) {
    vec3 colour = 0.5 + SH_C0 * stored_dc(at);
    if (SH_DEGREE > 0) {
        float basis[SH_REST_MAX];
        sh_basis(direction, basis);
        colour += stored_rest(at, basis);
    }
    return max(colour, 0.0);
}

void main() {
    splat_shape = uvec4(0u);
    splat_light = uvec4(0u);
#if PAGE_SHAPED
    splat_exponent = 0u;
#endif
    ivec2 at;
    if (!stored_at(at)) return;
    const vec4 position = stored_place(at);
    const vec3 to_splat = from_centre(camera, position.xyz);
    const vec3 p = to_camera(camera, to_splat);
    if (!magnitude_below(p, 1e30) || !(p.z > camera.near_plane)) return;

    float opacity = position.w, exponent = 0.0;
#if PAGE_SHAPED
    float by_shape;
    exponent = shape_exponent(stored_shape(at), by_shape);
    splat_exponent = floatBitsToUint(exponent);
#endif
    float reach = kernel_reach(opacity, exponent);
    if (!(reach > 0.0)) return;

    const vec3 s = exp(clamp(stored_size(at), -LOG_SCALE_LIMIT, LOG_SCALE_LIMIT)) *
        sqrt(kernel_covariance_scale(exponent));
    vec3 j0, j1;
    jacobian_rows(camera, p, j0, j1);
    const mat3 axes = rotation_matrix(stored_turn(at));
    const vec3 r1 = (to_world(camera, j0) * axes) * s;
    const vec3 r2 = (to_world(camera, j1) * axes) * s;
    const Factor f = cholesky_factor(r1, r2, low_pass);
    const float unit_area = f.shrink * f.shrink;
    if (!is_finite(f.determinant) || !(f.determinant > DETERMINANT_MIN * unit_area * unit_area)) return;
    if (FILTERED) {
        opacity *= compensation(r1, r2, f);
        reach = kernel_reach(opacity, exponent);
        if (!(reach > 0.0)) return;
    }

    vec2 mean;
    if (!pixel_of(camera, p, mean)) return;
    const vec2 extent = sqrt(reach * vec2(f.a, f.c)) + 1.0;
    const vec2 frame = vec2(camera.width, camera.height);
    if (any(lessThan(mean + extent, vec2(0.0))) || any(greaterThan(mean - extent, frame))) return;

    const vec3 colour = min(splat_colour(at, normalize(to_splat)), HALF_LARGEST);
    splat_shape = floatBitsToUint(vec4(mean, f.l11, f.l21));
    splat_light = uvec4(floatBitsToUint(vec2(f.l22, opacity)),
        packHalf2x16(vec2(round_half(colour.r), round_half(colour.g))),
        packHalf2x16(vec2(round_half(colour.b), min(sqrt(reach) * 1.002, HALF_LARGEST))));
}
