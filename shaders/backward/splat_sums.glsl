// SPDX-License-Identifier: MIT
// What one splat at one pixel adds to the gradients of an intersection, walking back to front. T before a splat is T
// after it / (1 - alpha), with 1 - alpha >= 0.01 by ALPHA_MAX. What lies behind, dotted with dL/dcolour, is a convex
// combination, so nothing cancels. Needs kernels/kernel.glsl and backward/depth_gradient.glsl.

// Sums over pixels. G = opacity dL/dalpha dw/dq, here without the opacity; so is the exponent's, with SHAPED.
struct Sums {
    float gx, gxx, gxdy, gdy, gdydy, opacity, exponent, depth;
    vec3 colour;
};

const Sums NO_SUMS = Sums(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, vec3(0.0));

// to_mean: mean - centre of the pixel. reached: the pixel had not ended before this splat. On entry transmittance and
// behind belong to what lies behind the splat, afterwards to what lies before it. z, d_z: with DEPTH_SUM, otherwise 0;
// d_z as load_depth_gradient has it.
void add_pixel(inout Sums s, inout float transmittance, inout float behind, vec2 to_mean, vec4 shape,
               float l22, vec4 light, float exponent, float z, vec3 d_colour, vec3 d_z, bool reached) {
    const float x = shape.z * to_mean.x + shape.w * to_mean.y, y = l22 * to_mean.y;
    float w, slope, by_exponent;
    kernel_value_slope(x * x + y * y, exponent, w, slope, by_exponent);
    const float raw = light.w * w;
    const bool counts = raw >= ALPHA_CUTOFF && reached;
    const float alpha = mix(0.0, min(raw, ALPHA_MAX), counts);
    const float before = transmittance / (1.0 - alpha);
    float ahead = dot(light.rgb, d_colour) - behind;
    if (DEPTH_SUM == 1) ahead += depth_by_weight(z, d_z);
    const float d_alpha = mix(0.0, before * ahead, counts && raw < ALPHA_MAX);
    const float g = d_alpha * slope, gx = g * x, gdy = g * to_mean.y;
    s.gx += gx;
    s.gxx += gx * x;
    s.gxdy += gx * to_mean.y;
    s.gdy += gdy;
    s.gdydy += gdy * to_mean.y;
    s.opacity += d_alpha * w;
    if (SHAPED) s.exponent += d_alpha * by_exponent;
    s.colour += (alpha * before) * d_colour;
    if (DEPTH_SUM == 1) s.depth += (alpha * before) * depth_by_depth(z, d_z);
    behind += alpha * ahead;
    transmittance = before;
}
