// SPDX-License-Identifier: MIT
// The kernels by the formulas of the paper, with sqrt, division and the built-in exp, sin and cos, corrected near d =
// 0. They serve to compare cost and accuracy; Vulkan leaves sin and cos an error of 2^-11. Only some kernels have such
// a formula: others, and the exact footprints of the compact ones, keep their polynomial. KERNEL_SUPPORT ends the
// pulses. There is no polynomial for more than one pulse, so those take sin and cos of kernels/sine.glsl.
#include "kernels/sine.glsl"

float kernel_sin(float x) {
    return KERNEL_PULSES > 1 ? steady_sin(x) : sin(x);
}

float kernel_cos(float x) {
    return KERNEL_PULSES > 1 ? steady_cos(x) : cos(x);
}

bool builtin_exists() {
    return KERNEL == KERNEL_GAUSSIAN ||
           (FOOTPRINT == FOOTPRINT_PSI &&
            (KERNEL == KERNEL_RAISED_COSINE || KERNEL == KERNEL_HALF_COSINE_SQUARED ||
             KERNEL == KERNEL_SINC || KERNEL == KERNEL_COSINE ||
             KERNEL == KERNEL_SQUARED_RAISED_COSINE));
}

const float PI = 3.14159265;

// sin(x)/x. Below x = 1/2 it is a series, good to 1.1e-8: there sin(x) may be off absolutely, or 0 for small angles,
// and 0/0 occurs at the centre.
float sinc(float x) {
    const float s = x * x;
    return s < 0.25 ? 1.0 - s * (1.0 / 6.0 - s * (1.0 / 120.0 - s * (1.0 / 5040.0))) : kernel_sin(x) / x;
}

// sinc and its derivative by x^2. The derivative's closed form cancels near 0.
void sinc_slope(float x, out float w, out float slope) {
    const float s = x * x;
    w = sinc(x);
    slope = s < 0.25 ? -1.0 / 6.0 + s * (1.0 / 60.0 - s * (1.0 / 1680.0))
                     : (kernel_cos(x) - w) / (2.0 * s);
}

void builtin_value_slope(float q, out float w, out float slope) {
    if (KERNEL == KERNEL_GAUSSIAN) {
        w = exp(-0.5 * q);
        slope = -0.5 * w;
        return;
    }
    const float d = sqrt(q);
    if (KERNEL == KERNEL_RAISED_COSINE) {
        const float k = PI / 2.5;
        w = 0.5 + 0.5 * kernel_cos(k * d);
        slope = -0.25 * k * k * sinc(k * d);
    } else if (KERNEL == KERNEL_HALF_COSINE_SQUARED) {
        const float k = PI / 18.0;
        w = kernel_cos(k * q);
        slope = -k * kernel_sin(k * q);
    } else if (KERNEL == KERNEL_SINC) {
        const float k = PI / 3.0;
        sinc_slope(k * d, w, slope);
        slope *= k * k;
        if (KERNEL_PULSES > 1 && w < 0.0) {  // the alpha of a negative ring would be below any cut-off
            w = -w;
            slope = -slope;
        }
    } else if (KERNEL == KERNEL_COSINE) {
        const float k = PI / 6.0;
        w = kernel_cos(k * d);
        slope = -0.5 * k * k * sinc(k * d);
    } else {
        const float k = PI / 3.0;
        const float root = 0.5 + 0.5 * kernel_cos(k * d);
        w = root * root;
        slope = -0.5 * k * k * root * sinc(k * d);
    }
    const bool inside = q < KERNEL_SUPPORT;
    w = inside ? max(w, 0.0) : 0.0;
    slope = inside ? slope : 0.0;
}
