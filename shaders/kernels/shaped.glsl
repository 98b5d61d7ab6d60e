// SPDX-License-Identifier: MIT
// What each kernel with a shape for each splat provides to the passes; the counterpart is ShapedKernel
// (engine/kernels/shaped_kernel.h). Constant folding leaves one of them, or none.
layout(constant_id = 113) const int BLENDED = 0;  // 1: a blend of the kernel with that of BLEND_*

const bool SHAPED = BLENDED == 1 || KERNEL_FORM == KERNEL_FORM_BETA || KERNEL_FORM == KERNEL_FORM_EXPONENTIAL ||
                    KERNEL_FORM == KERNEL_FORM_GES;

#include "kernels/beta.glsl"
#include "kernels/exponential.glsl"
#include "kernels/blend.glsl"
#include "kernels/ges.glsl"

// For a kernel that is not a blend. Also gives dw/d(exponent), which is 0 on entry.
void shaped_value_slope(float q, float exponent, out float w, out float slope, inout float by_exponent) {
    if (KERNEL_FORM == KERNEL_FORM_EXPONENTIAL)
        exponential_value_slope(q, exponent, w, slope, by_exponent);
    else if (KERNEL_FORM == KERNEL_FORM_GES)
        ges_value_slope(q, w, slope);
    else
        beta_value_slope(q, exponent, w, slope, by_exponent);
}

// The exponent of a splat's shape and its derivative, which is 0 where the exponent is held at a bound.
float shape_exponent(float shape, out float by_shape) {
    if (BLENDED == 1) return blend_exponent(shape, by_shape);
    if (KERNEL_FORM == KERNEL_FORM_EXPONENTIAL) return exponential_exponent(shape, by_shape);
    if (KERNEL_FORM == KERNEL_FORM_GES) return ges_exponent(shape, by_shape);
    return beta_exponent(shape, by_shape);
}

// The q where w is `least`, below 1, for a kernel that is not a blend.
float shaped_reach(float exponent, float least) {
    if (KERNEL_FORM == KERNEL_FORM_EXPONENTIAL) return exponential_reach(exponent, least);
    if (KERNEL_FORM == KERNEL_FORM_GES) return -2.0 * log(least);
    return beta_reach(exponent, least);
}

float shaped_covariance_scale(float exponent) {
    if (BLENDED == 1) return blend_covariance_scale(exponent);
    if (KERNEL_FORM == KERNEL_FORM_EXPONENTIAL) return exponential_covariance_scale(exponent);
    if (KERNEL_FORM == KERNEL_FORM_GES) return ges_covariance_scale(exponent);
    return beta_covariance_scale(exponent);
}

// Half of d ln shaped_covariance_scale / d(exponent), which is that of lengths.
float shaped_length_slope(float exponent) {
    if (BLENDED == 1) return blend_length_slope(exponent);
    if (KERNEL_FORM == KERNEL_FORM_EXPONENTIAL) return exponential_length_slope(exponent);
    if (KERNEL_FORM == KERNEL_FORM_GES) return ges_length_slope(exponent);
    return beta_length_slope(exponent);
}

// The q beyond which w is 0; 3e38 where it never is.
float shaped_support() {
    return BLENDED == 1 ? max(KERNEL_SUPPORT, BLEND_SUPPORT) : KERNEL_SUPPORT;
}
