// SPDX-License-Identifier: MIT
// The SSIM window, 11 taps of sigma 1.5, and SSIM from blurred maps.

const float TAP0 = 0.26601171493530273, TAP1 = 0.2130055278539657, TAP2 = 0.1093606948852539,
            TAP3 = 0.03600077331066132, TAP4 = 0.007598758675158024, TAP5 = 0.001028380123898387;
const float SSIM_C1 = 1e-4, SSIM_C2 = 9e-4;

float blur(float v0, float v1, float v2, float v3, float v4, float v5) {
    return TAP0 * v0 + TAP1 * v1 + TAP2 * v2 + TAP3 * v3 + TAP4 * v4 + TAP5 * v5;
}

vec4 blur(vec4 v0, vec4 v1, vec4 v2, vec4 v3, vec4 v4, vec4 v5) {
    return TAP0 * v0 + TAP1 * v1 + TAP2 * v2 + TAP3 * v3 + TAP4 * v4 + TAP5 * v5;
}

// SSIM from the means of a = x + y, b = x - y, a^2 and b^2, with E[x y] = (aa - bb) / 4 and E[x^2 + y^2] = (aa + bb) /
// 2. d: dS/dx_i = d.x + a_i d.y + b_i d.z, each times the window.
float ssim(float a, float b, float aa, float bb, out vec3 d) {
    const float var_a = aa - a * a, var_b = bb - b * b;
    const float light = 0.5 * (a * a - b * b) + SSIM_C1, light_max = 0.5 * (a * a + b * b) + SSIM_C1;
    const float shape = 0.5 * (var_a - var_b) + SSIM_C2, shape_max = 0.5 * (var_a + var_b) + SSIM_C2;
    const float inv_light = 1.0 / light_max, inv_shape = 1.0 / shape_max;
    const float l = light * inv_light, c = shape * inv_shape;
    // 2 dS/daa and 2 dS/dbb with the means held; then dS of the means, which the variances contain, too.
    d.y = l * inv_shape * (1.0 - c);
    d.z = -l * inv_shape * (1.0 + c);
    d.x = a * (c * inv_light * (1.0 - l) - d.y) - b * (c * inv_light * (1.0 + l) + d.z);
    return l * c;
}
