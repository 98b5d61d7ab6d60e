// SPDX-License-Identifier: MIT
// In the place of shaders/kernels/shaped.glsl: pages draw no kernels whose shape each splat has of its own.
const bool SHAPED = false;
const int BLENDED = 0;

void shaped_value_slope(float q, float exponent, out float w, out float slope, out float by_exponent) {
    w = slope = by_exponent = 0.0;
}
float shaped_reach(float exponent, float least) {
    return 0.0;
}
float shaped_support() {
    return KERNEL_SUPPORT;
}
float shaped_covariance_scale(float exponent) {
    return 1.0;
}
void blend_value_slope(float q, float m, inout float w, inout float slope, inout float by_exponent) {}
float blend_farthest(float least) {
    return 0.0;
}
