// w = u^a P(x), u = 1 - x, x = t or t^2, t = q/R^2: every kernel that falls to zero at its edge, and its exact
// footprint. slope = u^(a-1) (u P' - a P) dx/dq. Source: Taylor forms of the kernels, fitted by engine/kernels.
void compact_value_slope(float q, out float w, out float slope) {
    const float t = q * KERNEL_INVERSE_SUPPORT;
    const float x = KERNEL_SQUARED_VARIABLE != 0 ? t * t : t;
    const float dx =
        KERNEL_SQUARED_VARIABLE != 0 ? 2.0 * KERNEL_INVERSE_SUPPORT * t : KERNEL_INVERSE_SUPPORT;
    const float u = max(1.0 - x, 0.0);
    float lower = u > 0.0 ? 1.0 : 0.0;  // u^(a-1); u^0 for a = 0. The mask is needed for a <= 1 only
    if (KERNEL_HALF_POWER == 1) lower = u > 0.0 ? inversesqrt(u) : 0.0;
    if (KERNEL_HALF_POWER == 3 || KERNEL_HALF_POWER == 5 || KERNEL_HALF_POWER == 7) lower = sqrt(u);
    if (KERNEL_HALF_POWER == 4) lower = u;
    if (KERNEL_HALF_POWER >= 5 && KERNEL_HALF_POWER != 6) lower *= u;
    if (KERNEL_HALF_POWER >= 6) lower = KERNEL_HALF_POWER == 6 ? u * u : lower * u;
    float p, dp;
    kernel_polynomial(x, p, dp);
    if (KERNEL_HALF_POWER == 0) {
        w = max(lower * p, 0.0);
        slope = lower * dp * dx;
    } else {
        w = max(lower * u * p, 0.0);
        slope = lower * (u * dp - 0.5 * float(KERNEL_HALF_POWER) * p) * dx;
    }
}
