// What each kernel whose shape each splat has of its own is to the passes; their twin is ShapedKernel
// (engine/kernels/shaped_kernel.h). One of them is left after constant folding, or none.
const bool SHAPED = KERNEL_FORM == KERNEL_FORM_BETA || KERNEL_FORM == KERNEL_FORM_EXPONENTIAL;

#include "kernels/beta.glsl"
#include "kernels/exponential.glsl"

// Also dw by the exponent.
void shaped_value_slope(float q, float exponent, out float w, out float slope, out float by_exponent) {
    if (KERNEL_FORM == KERNEL_FORM_EXPONENTIAL)
        exponential_value_slope(q, exponent, w, slope, by_exponent);
    else
        beta_value_slope(q, exponent, w, slope, by_exponent);
}

// The exponent of a splat's shape, and its derivative, 0 where it is held.
float shape_exponent(float shape, out float by_shape) {
    return KERNEL_FORM == KERNEL_FORM_EXPONENTIAL ? exponential_exponent(shape, by_shape)
                                                  : beta_exponent(shape, by_shape);
}

// Where w is `least`, below 1.
float shaped_reach(float exponent, float least) {
    return KERNEL_FORM == KERNEL_FORM_EXPONENTIAL ? exponential_reach(exponent, least)
                                                  : beta_reach(exponent, least);
}

float shaped_covariance_scale(float exponent) {
    return KERNEL_FORM == KERNEL_FORM_EXPONENTIAL ? exponential_covariance_scale(exponent)
                                                  : beta_covariance_scale(exponent);
}

// Half of d ln shaped_covariance_scale by the exponent: of the lengths.
float shaped_length_slope(float exponent) {
    return KERNEL_FORM == KERNEL_FORM_EXPONENTIAL ? exponential_length_slope(exponent)
                                                  : beta_length_slope(exponent);
}
