// SPDX-License-Identifier: MIT
// w = exp(-q/2), with lengths that are those of the splat times f(t): the kernel `ges_published`, which is GES as its
// program draws it. t is a parameter of each splat (engine/kernels/shaped_kernel.cpp) and enters only through psi =
// f^2.
void ges_value_slope(float q, out float w, out float slope) {
    gaussian_value_slope(first_kernel(), q, w, slope);
    if (EVALUATION != EVALUATION_BUILTIN) return;
    w = exp(-0.5 * q);
    slope = -0.5 * w;
}

float ges_exponent(float shape, out float by_shape) {
    const float free = GES_START + shape;
    by_shape = free > GES_LEAST && free < GES_MOST ? 1.0 : 0.0;
    return clamp(free, GES_LEAST, GES_MOST);
}

float ges_factor(float t) {
    return 2.0 / (1.0 + exp(-GES_STRENGTH * (t - GES_START)));
}
float ges_covariance_scale(float t) {
    const float f = ges_factor(t);
    return f * f;
}
// d ln f / dt.
float ges_length_slope(float t) {
    return GES_STRENGTH * (1.0 - 0.5 * ges_factor(t));
}
