// SPDX-License-Identifier: MIT
// The kernel contract of all shaders: w and dw/dq as functions of q = d^2, and how far they reach. A set of
// specialization constants selects the kernel (engine/raster/kernel_constants.h sets them), so that constant folding
// leaves the arithmetic of one kernel. With the constants unset, it is the Gaussian by exp(). Accuracy: only
// multiplications and additions where Vulkan promises correct rounding; see KernelCoefficients. The including shader
// enables GL_GOOGLE_include_directive.
#ifndef DARB_KERNEL_GLSL
#define DARB_KERNEL_GLSL

#include "shared/kernel_forms.h"
#include "shared/kernel_list.h"
#include "shared/limits.h"

layout(constant_id = 100) const int KERNEL = KERNEL_GAUSSIAN;
layout(constant_id = 101) const int FOOTPRINT = FOOTPRINT_PSI;
layout(constant_id = 102) const int EVALUATION = EVALUATION_BUILTIN;
layout(constant_id = 103) const int KERNEL_FORM = KERNEL_FORM_GAUSSIAN;
layout(constant_id = 104) const int KERNEL_DEGREE = 0;
layout(constant_id = 105) const int KERNEL_HALF_POWER = 0;        // 2a of u^a, 2e of (1+q)^-e
layout(constant_id = 106) const int KERNEL_SQUARED_VARIABLE = 0;  // x = t^2 rather than t = q/R^2
layout(constant_id = 107) const float KERNEL_SUPPORT = 3e38;      // R^2
layout(constant_id = 108) const float KERNEL_INVERSE_SUPPORT = 0.0;  // rounded up: u <= 0 at the edge
layout(constant_id = 109) const float COVARIANCE_SCALE = 1.0;        // psi, or 1
layout(constant_id = 110) const float ALPHA_CUTOFF = ALPHA_CUTOFF_DEFAULT;
layout(constant_id = 111) const float KERNEL_REACH_MARGIN = 1e-5;  // relative margin of w in kernel_reach
layout(constant_id = 112) const int KERNEL_PULSES = 1;  // more than 1: form RINGS, built-in only
layout(constant_id = 120) const float KERNEL_C0 = 1.0;  // coefficients of P, rising powers; for RINGS: see its form
layout(constant_id = 121) const float KERNEL_C1 = 0.0;
layout(constant_id = 122) const float KERNEL_C2 = 0.0;
layout(constant_id = 123) const float KERNEL_C3 = 0.0;
layout(constant_id = 124) const float KERNEL_C4 = 0.0;
layout(constant_id = 125) const float KERNEL_C5 = 0.0;
layout(constant_id = 126) const float KERNEL_C6 = 0.0;
layout(constant_id = 127) const float KERNEL_C7 = 0.0;
layout(constant_id = 128) const float KERNEL_C8 = 0.0;

#include "kernels/parameters.glsl"

// The kernel; for a blend of two, the first one.
KernelParameters first_kernel() {
    return KernelParameters(
        KERNEL_FORM, KERNEL_DEGREE, KERNEL_HALF_POWER, KERNEL_SQUARED_VARIABLE, KERNEL_SUPPORT, KERNEL_INVERSE_SUPPORT,
        float[](KERNEL_C0, KERNEL_C1, KERNEL_C2, KERNEL_C3, KERNEL_C4, KERNEL_C5, KERNEL_C6, KERNEL_C7, KERNEL_C8));
}

#include "kernels/polynomial.glsl"

#include "kernels/builtin.glsl"
#include "kernels/compact.glsl"
#include "kernels/gaussian.glsl"
#include "kernels/quadric.glsl"

// For the forms without a shape for each splat.
void form_value_slope(const KernelParameters k, float q, out float w, out float slope) {
    if (k.form == KERNEL_FORM_COMPACT)
        compact_value_slope(k, q, w, slope);
    else if (k.form == KERNEL_FORM_GAUSSIAN)
        gaussian_value_slope(k, q, w, slope);
    else
        quadric_value_slope(k, q, w, slope);
}

#include "kernels/shaped.glsl"

// For a fixed kernel, or a blend of two. This is a separate function so that a shader has few copies of all kernels:
// drivers inline each call, and some fold the constants only afterwards.
void fixed_value_slope(float q, float exponent, out float w, out float slope, inout float by_exponent) {
    if (EVALUATION == EVALUATION_BUILTIN && BLENDED == 0 && builtin_exists())
        builtin_value_slope(q, w, slope);
    else
        form_value_slope(first_kernel(), q, w, slope);
    if (BLENDED == 1) blend_value_slope(q, exponent, w, slope, by_exponent);
}

// w and its derivative by q, for q >= 0. Both are 0 at and beyond the support's edge, and w is never negative. The
// slope is the derivative of the w computed here. exponent: the splat's, for a kernel with shapes; by_exponent:
// dw/d(exponent).
void kernel_value_slope(float q, float exponent, out float w, out float slope, out float by_exponent) {
    by_exponent = 0.0;
    if (SHAPED && BLENDED == 0)
        shaped_value_slope(q, exponent, w, slope, by_exponent);
    else
        fixed_value_slope(q, exponent, w, slope, by_exponent);
}

float kernel_value(float q, float exponent) {
    float w, slope, by_exponent;
    kernel_value_slope(q, exponent, w, slope, by_exponent);
    return w;
}

// Where w of RINGS falls through `least`, which is at most 1, for the last time: the range outside the peak of that
// pulse.
void last_flank(float least, out float low, out float high) {
    float w, slope;
    low = KERNEL_C0;
    high = KERNEL_C1;
    if (KERNEL_PULSES > 1) {
        builtin_value_slope(KERNEL_C2, w, slope);
        if (w >= least) {
            low = KERNEL_C2;
            high = KERNEL_C3;
        }
    }
    if (KERNEL_PULSES > 2) {
        builtin_value_slope(KERNEL_C4, w, slope);
        if (w >= least) {
            low = KERNEL_C4;
            high = KERNEL_C5;
        }
    }
}

bool has_closed_reach() {
    return BLENDED == 0 && (SHAPED || KERNEL_FORM == KERNEL_FORM_GAUSSIAN ||
                            (KERNEL_FORM == KERNEL_FORM_QUADRIC && FOOTPRINT == FOOTPRINT_PSI));
}

// The q beyond which opacity * w < ALPHA_CUTOFF, rounded outwards and at most R^2; 0 below the cut-off. It runs once
// per splat, with closed forms where there are any. Otherwise it halves [0, R^2], or a pulse's outer flank, on the
// falling w that is computed.
float kernel_reach(float opacity, float exponent) {
    if (!(opacity >= ALPHA_CUTOFF)) return 0.0;
    const float least = ALPHA_CUTOFF * (1.0 - KERNEL_REACH_MARGIN) / opacity;
    float q;
    if (!has_closed_reach()) {
        float low = 0.0, high = BLENDED == 1 ? blend_farthest(least) * 1.0001 : KERNEL_SUPPORT;
        if (KERNEL_FORM == KERNEL_FORM_RINGS) last_flank(least, low, high);
        for (int step = 0; step < 24; ++step) {
            const float middle = 0.5 * (low + high);
            float w, slope, by_exponent;
            fixed_value_slope(middle, exponent, w, slope, by_exponent);
            const bool inside = w >= least;
            low = inside ? middle : low;
            high = inside ? high : middle;
        }
        q = high;
    } else if (SHAPED) {
        q = shaped_reach(exponent, least);
    } else if (KERNEL_FORM == KERNEL_FORM_GAUSSIAN) {
        q = -2.0 * log(least);
    } else {
        q = 1.0 / (KERNEL_HALF_POWER == 2 ? least : least * least) - 1.0;
    }
    return min(q * (1.0 + 1e-5), SHAPED ? shaped_support() : KERNEL_SUPPORT);
}

// The factor of the projected 2x2 covariance before the low-pass.
float kernel_covariance_scale(float exponent) {
    return SHAPED ? shaped_covariance_scale(exponent) : COVARIANCE_SCALE;
}

#endif
