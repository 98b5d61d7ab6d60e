// SPDX-License-Identifier: MIT
// The Gaussian by logarithms: opacity * w = 2^e, e = log2(opacity) - x^2 - y^2, with the factor scaled by FACTOR_SCALE.
// This saves the products for the scale of the exponent and for the opacity. LOG_FORM is true where the slope is -w/2.
// Needs kernels/kernel.glsl.
#ifndef DARB_LOG_FORM_GLSL
#define DARB_LOG_FORM_GLSL

const bool STEADY_SLOPE = EVALUATION == EVALUATION_BUILTIN || KERNEL_DEGREE >= 5;
const bool PLAIN_EXPONENT = KERNEL_FORM == KERNEL_FORM_GAUSSIAN || KERNEL_FORM == KERNEL_FORM_GES;
const bool LOG_FORM = PLAIN_EXPONENT && STEADY_SLOPE && BLENDED == 0;
const float FACTOR_SCALE = 0.84932180;  // sqrt(log2(e) / 2)

float power_of_log(float e) {
    if (EVALUATION == EVALUATION_BUILTIN) return exp2(e);
    const float y = max(e, -126.0), n = roundEven(y);
    float p, dp;
    kernel_polynomial(first_kernel(), y - n, p, dp);
    return intBitsToFloat(floatBitsToInt(p) + (int(n) << 23));
}

#endif
