// SPDX-License-Identifier: MIT
// Projected splats as project.comp leaves them for the passes over intersections, in float32 or float16. Needs
// SHAPE_BINDING, LIGHT_BINDING and BOUND_BINDING; each buffer has two views, and STORAGE picks one.
#include "lib/half.glsl"

layout(set = 0, binding = SHAPE_BINDING, scalar) readonly buffer SplatShape { vec4 splat_shape[]; };
layout(set = 0, binding = SHAPE_BINDING, scalar) readonly buffer SplatShapeHalf { uvec4 splat_shape_half[]; };
layout(set = 0, binding = BOUND_BINDING, scalar) readonly buffer SplatBound { vec4 splat_bound[]; };
#ifdef LIGHT_BINDING
layout(set = 0, binding = LIGHT_BINDING, scalar) readonly buffer SplatLight { vec4 splat_light[]; };
layout(set = 0, binding = LIGHT_BINDING, scalar) readonly buffer SplatLightHalf { uvec2 splat_light_half[]; };

vec4 load_light(uint splat) {  // rgb, opacity
    if (STORAGE == STORAGE_FLOAT32) return splat_light[splat];
    const uvec2 w = splat_light_half[splat];
    return vec4(unpackHalf2x16(w.x), unpackHalf2x16(w.y));
}
#endif

// Returns mean, l11, l21; l22 goes to the argument.
vec4 load_shape(uint splat, out float l22) {
    if (STORAGE == STORAGE_FLOAT32) {
        l22 = splat_bound[splat].x;
        return splat_shape[splat];
    }
    const uvec4 w = splat_shape_half[splat];
    l22 = unpackHalf2x16(w.w).x;
    return vec4(uintBitsToFloat(w.xy), unpackHalf2x16(w.z));
}
