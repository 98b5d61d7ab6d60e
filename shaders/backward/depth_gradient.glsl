// SPDX-License-Identifier: MIT
// What dL/d(image) says of a pixel's depths, and what that makes of a splat's depth z. Needs d_image and
// lib/depth_sum.glsl.
#ifndef DARB_DEPTH_GRADIENT_GLSL
#define DARB_DEPTH_GRADIENT_GLSL

// dL/d(sum w z); with DEPTH_SPREAD also dL/d(sum w z z), and the depth z0 that z is counted from. plane: pixels.
vec3 load_depth_gradient(uint plane, uint pixel) {
    vec3 d = vec3(d_image[DEPTH_GRADIENT_PLANE * plane + pixel], 0.0, 0.0);
    if (DEPTH_SPREAD == 1) {
        d.y = d_image[SQUARE_GRADIENT_PLANE * plane + pixel];
        d.z = d_image[FIRST_DEPTH_GRADIENT_PLANE * plane + pixel];
    }
    return d;
}

// dL/dw by the depth.
float depth_by_weight(float z, vec3 d) {
    if (DEPTH_SPREAD == 0) return z * d.x;
    z -= d.z;
    return z * (d.x + z * d.y);
}

// dL/dz over w.
float depth_by_depth(float z, vec3 d) {
    return DEPTH_SPREAD == 1 ? d.x + 2.0 * (z - d.z) * d.y : d.x;
}

#endif
