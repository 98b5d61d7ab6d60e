// SPDX-License-Identifier: MIT
// w = u^a P(x), u = 1 - x, x = t or t^2, t = q/R^2: every kernel that falls to zero at its edge, and its exact
// footprint. slope = u^(a-1) (u P' - a P) dx/dq. Source: Taylor forms of the kernels, fitted by engine/kernels. This
// computes u^(a-1) for a from 3/2 to 9/2; the tests of the constant fold away.
float compact_power(const KernelParameters k, float u) {
    const int power = k.half_power / 2 - 1;  // whole powers of u
    const float u2 = u * u;
    const float whole = power == 0 ? 1.0 : power == 1 ? u : power == 2 ? u2 : u2 * u;
    return (k.half_power & 1) == 0 ? whole : power == 0 ? sqrt(u) : sqrt(u) * whole;
}

void compact_value_slope(const KernelParameters k, float q, out float w, out float slope) {
    const float t = min(q * k.inverse_support, 1.0);
    const float x = k.squared_variable != 0 ? t * t : t;
    const float dx =
        k.squared_variable != 0 ? 2.0 * k.inverse_support * t : k.inverse_support;
    const float u = 1.0 - x;
    float lower = u > 0.0 ? 1.0 : 0.0;  // u^(a-1); u^0 for a = 0. Only a <= 1 needs the mask
    if (k.half_power == 1) lower = mix(0.0, inversesqrt(u), u > 0.0);
    if (k.half_power > 2) lower = compact_power(k, u);
    float p, dp;
    kernel_polynomial(k, x, p, dp);
    if (k.half_power == 0) {
        w = lower * p;
        slope = lower * dp * dx;
    } else {
        w = lower * u * p;
        slope = lower * (u * dp - 0.5 * float(k.half_power) * p) * dx;
    }
}
