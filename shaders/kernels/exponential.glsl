// SPDX-License-Identifier: MIT
// w = exp(-((q + s)^(t/2) - s^(t/2)) / 2): the kernel `generalized_exponential`, whose exponent t each splat has of its
// own (engine/kernels/shaped_kernel.cpp). s bounds the slope at the centre. w is 1 there, because both powers come out
// of the same steps; that of s is a constant of the splat. A pixel takes one logarithm and two powers of two, made of
// multiplications and additions alone and in pairs, as each waits for the one before; a division costs as much as ten
// of them.

// log2 x, x > 0, to 6e-7, to 1.2e-7 between 1/2 and 2: x = 2^k m, m from the root of 1/2 to that of 2, and a
// polynomial in m - 1 that is 0 at m = 1, off by 5e-8 at most.
float log2_steady(float x) {
    const int k = (floatBitsToInt(x) - 0x3F3504F3) >> 23;
    const float y = intBitsToFloat(floatBitsToInt(x) - (k << 23)) - 1.0, y2 = y * y, y4 = y2 * y2;
    const float low = (1.44269478 - 0.721357167 * y) + y2 * (0.480939448 - 0.360087216 * y);
    const float high = (0.286707461 - 0.250069052 * y) + y2 * (0.236890376 - 0.145744473 * y);
    return y * (low + y4 * high) + float(k);
}

// 2^y for y between -126 and 127, by the Gaussian's polynomial.
float power_in_pairs(float y) {
    const float n = roundEven(y), f = y - n, f2 = f * f;
    float p = KERNEL_C0 + KERNEL_C1 * f + f2 * (KERNEL_C2 + KERNEL_C3 * f + f2 * (KERNEL_C4 + KERNEL_C5 * f)), dp;
    if (KERNEL_DEGREE > 5) kernel_polynomial(first_kernel(), f, p, dp);
    return intBitsToFloat(floatBitsToInt(p) + (int(n) << 23));
}

float exponential_log2(float x) {
    return EVALUATION == EVALUATION_BUILTIN ? log2(x) : log2_steady(x);
}

float exponential_exp2(float y) {
    return EVALUATION == EVALUATION_BUILTIN ? exp2(y) : power_in_pairs(y);
}

// Also gives dw/dt.
void exponential_value_slope(float q, float t, out float w, out float slope, out float by_exponent) {
    const float half_t = 0.5 * t;
    const float v = q + EXPONENTIAL_SOFTENING, l = exponential_log2(v);
    const float p = exponential_exp2(min(half_t * l, 7.0));  // where it is held at 7, w is below 2^-92
    const float first = exponential_exp2(half_t * EXPONENTIAL_SOFTENING_LOG2);
    w = exponential_exp2((p - first) * -0.72134752);  // log2(e)/2
    const float pw = p * w;
    slope = -0.5 * half_t * (pw / v);
    by_exponent = 0.17328680 * (w * (first * EXPONENTIAL_SOFTENING_LOG2) - pw * l);  // ln(2)/4
}

float exponential_exponent(float shape, out float by_shape) {
    const float free = EXPONENTIAL_START * exp(min(shape, 80.0));
    by_shape = free > EXPONENTIAL_LEAST && free < EXPONENTIAL_MOST ? free : 0.0;
    return clamp(free, EXPONENTIAL_LEAST, EXPONENTIAL_MOST);
}

float exponential_reach(float t, float least) {
    const float first = exp2(0.5 * t * EXPONENTIAL_SOFTENING_LOG2);
    return exp2(2.0 / t * log2(first - 2.0 * log(least))) - EXPONENTIAL_SOFTENING;
}

// ln psi = (x - 1/2) P(x), x = 1/t.
float exponential_log_psi(float x, out float slope) {
    const float c[7] = float[](EXPONENTIAL_PSI);
    float p = 0.0, dp = 0.0;
    for (int k = 6; k >= 0; --k) {
        dp = dp * x + p;
        p = p * x + c[k];
    }
    slope = p + (x - 0.5) * dp;
    return (x - 0.5) * p;
}
float exponential_covariance_scale(float t) {
    float slope;
    return FOOTPRINT == FOOTPRINT_PSI ? exp(exponential_log_psi(1.0 / t, slope)) : 1.0;
}
float exponential_length_slope(float t) {
    float slope;
    exponential_log_psi(1.0 / t, slope);
    return FOOTPRINT == FOOTPRINT_PSI ? -0.5 * slope / (t * t) : 0.0;
}
