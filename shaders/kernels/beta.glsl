// SPDX-License-Identifier: MIT
// w = u^e = 2^(e log2 u), u = 1 - q/R^2: the kernel `beta`, whose exponent e each splat has of its own
// (engine/kernels/shaped_kernel.cpp). log2 is made of additions, multiplications and one division, so that it is 0 at a
// centre and a device has the accuracy of float32. Vulkan's log2 may be off by 2^-21.

// log2((1 + s)/(1 - s)).
float log2_series(float s) {
    const float s2 = s * s;
    return s * (2.88539008 + s2 * (0.961796694 + s2 * (0.577078016 + s2 * (0.412198583 + s2 * 0.320598898))));
}

// log2(1 - t), 0 <= t < 1: 1 - t = 2^k m, m from the root of 1/2 to that of 2, and the series of
// log((1 + s)/(1 - s)), s = (m - 1)/(m + 1), to 1e-8. For k = 0 m - 1 is -t, without cancellation.
float log2_of_rest(float t) {
    const float u = 1.0 - t;
    const int k = (floatBitsToInt(u) - 0x3F3504F3) >> 23;
    const float m = intBitsToFloat(floatBitsToInt(u) - (k << 23));
    return float(k) + log2_series(mix(m - 1.0, -t, k == 0) / (m + 1.0));
}

// 2^y for y <= 0, computed as the Gaussian's.
float power_of_two(float y) {
    const float above = max(y, -126.0), n = roundEven(above);
    float p, dp;
    kernel_polynomial(first_kernel(), above - n, p, dp);
    return intBitsToFloat(floatBitsToInt(p) + (int(n) << 23));
}

// Also gives dw/de = w ln u.
void beta_value_slope(float q, float exponent, out float w, out float slope, out float by_exponent) {
    const float t = min(q * KERNEL_INVERSE_SUPPORT, 1.0), u = 1.0 - t;
    const bool inside = u > 0.0;
    const bool built_in = EVALUATION == EVALUATION_BUILTIN;
    const float safe = inside ? t : 0.0;
    const float log_u = built_in ? log2(1.0 - safe) : log2_of_rest(safe);
    w = built_in ? exp2(exponent * log_u) : power_of_two(exponent * log_u);
    w = inside ? w : 0.0;
    slope = mix(0.0, -KERNEL_INVERSE_SUPPORT * exponent * w / u, inside);
    by_exponent = mix(0.0, 0.69314718 * w * log_u, inside);
}

// The exponent of a splat's shape and its derivative, which is 0 where the exponent is held at a bound.
float beta_exponent(float shape, out float by_shape) {
    by_shape = BETA_START * exp(min(shape, 80.0));
    const float free = by_shape + (FOOTPRINT == FOOTPRINT_EXACT ? 0.5 : 0.0);
    if (!(free > BETA_EXPONENT_LEAST && free < BETA_EXPONENT_MOST)) by_shape = 0.0;
    return clamp(free, BETA_EXPONENT_LEAST, BETA_EXPONENT_MOST);
}

float beta_reach(float exponent, float least) {
    return KERNEL_SUPPORT * (1.0 - exp2(log2(least) / exponent));
}

// psi = R^2 / (2 b + 5), and half of d ln psi / de, which is that of lengths.
float beta_covariance_scale(float exponent) {
    return FOOTPRINT == FOOTPRINT_PSI ? KERNEL_SUPPORT / (2.0 * exponent + 5.0) : 1.0;
}
float beta_length_slope(float exponent) {
    return FOOTPRINT == FOOTPRINT_PSI ? -1.0 / (2.0 * exponent + 5.0) : 0.0;
}
