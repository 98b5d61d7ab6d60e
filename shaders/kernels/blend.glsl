// SPDX-License-Identifier: MIT
// w = (1 - m) w1 + m w2 with an m of each splat's own: a blend of two kernels (engine/kernels/shaped_kernel.cpp). The
// first kernel has the constants KERNEL_*, the second has these, and its code is that of the first under other names.
layout(constant_id = 160) const int BLEND_FORM = KERNEL_FORM_GAUSSIAN;
layout(constant_id = 161) const int BLEND_DEGREE = 0;
layout(constant_id = 162) const int BLEND_HALF_POWER = 0;
layout(constant_id = 163) const int BLEND_SQUARED_VARIABLE = 0;
layout(constant_id = 164) const float BLEND_SUPPORT = 3e38;
layout(constant_id = 165) const float BLEND_INVERSE_SUPPORT = 0.0;
layout(constant_id = 166) const float BLEND_CENTRE_RATIO = 1.0;  // line integrals through the centres, second to first
layout(constant_id = 167) const float BLEND_FOURTH_1 = 1.0;  // moments in space; fourth: a third of it
layout(constant_id = 168) const float BLEND_FOURTH_2 = 1.0;
layout(constant_id = 169) const float BLEND_SECOND_1 = 1.0;
layout(constant_id = 170) const float BLEND_SECOND_2 = 1.0;
layout(constant_id = 180) const float BLEND_C0 = 1.0;
layout(constant_id = 181) const float BLEND_C1 = 0.0;
layout(constant_id = 182) const float BLEND_C2 = 0.0;
layout(constant_id = 183) const float BLEND_C3 = 0.0;
layout(constant_id = 184) const float BLEND_C4 = 0.0;
layout(constant_id = 185) const float BLEND_C5 = 0.0;
layout(constant_id = 186) const float BLEND_C6 = 0.0;
layout(constant_id = 187) const float BLEND_C7 = 0.0;
layout(constant_id = 188) const float BLEND_C8 = 0.0;

KernelParameters second_kernel() {
    return KernelParameters(
        BLEND_FORM, BLEND_DEGREE, BLEND_HALF_POWER, BLEND_SQUARED_VARIABLE, BLEND_SUPPORT, BLEND_INVERSE_SUPPORT,
        float[](BLEND_C0, BLEND_C1, BLEND_C2, BLEND_C3, BLEND_C4, BLEND_C5, BLEND_C6, BLEND_C7, BLEND_C8));
}

// Turns w and slope of the first kernel into those of the blend, and gives dw/dm.
void blend_value_slope(float q, float m, inout float w, inout float slope, out float by_exponent) {
    float w2, slope2;
    form_value_slope(second_kernel(), q, w2, slope2);
    by_exponent = w2 - w;
    w += m * by_exponent;
    slope += m * (slope2 - slope);
}

// m for the shape's weight 1 / (1 + exp(-shape)); with exact it is the weight of the normalised line integrals.
float blend_exponent(float shape, out float by_shape) {
    const float held = clamp(shape, -30.0, 30.0);
    const float m = 1.0 / (1.0 + exp(-held)), rest = 1.0 / (1.0 + exp(held));
    by_shape = held == shape ? m * rest : 0.0;
    if (FOOTPRINT == FOOTPRINT_PSI) return m;
    const float whole = rest + m * BLEND_CENTRE_RATIO;
    by_shape *= BLEND_CENTRE_RATIO / (whole * whole);
    return m * BLEND_CENTRE_RATIO / whole;
}

// The end of the larger support, or the q where a Gaussian is `least`: no blend reaches further.
float blend_farthest(float least) {
    const float gaussian = -2.0 * log(least);
    return max(KERNEL_FORM == KERNEL_FORM_GAUSSIAN ? gaussian : KERNEL_SUPPORT,
               BLEND_FORM == KERNEL_FORM_GAUSSIAN ? gaussian : BLEND_SUPPORT);
}

float blend_covariance_scale(float m) {
    return FOOTPRINT == FOOTPRINT_PSI
               ? mix(BLEND_FOURTH_1, BLEND_FOURTH_2, m) / mix(BLEND_SECOND_1, BLEND_SECOND_2, m)
               : 1.0;
}
float blend_length_slope(float m) {
    return FOOTPRINT == FOOTPRINT_PSI
               ? 0.5 * ((BLEND_FOURTH_2 - BLEND_FOURTH_1) / mix(BLEND_FOURTH_1, BLEND_FOURTH_2, m) -
                        (BLEND_SECOND_2 - BLEND_SECOND_1) / mix(BLEND_SECOND_1, BLEND_SECOND_2, m))
               : 0.0;
}
