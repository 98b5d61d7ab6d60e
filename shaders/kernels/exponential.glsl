// w = exp(-((q + s)^(t/2) - s^(t/2)) / 2): the kernel `generalized_exponential`, whose exponent t each splat has of
// its own (engine/kernels/shaped_exponential.cpp). s bounds the slope at the centre, and w is 1 there: both powers
// come out of the same steps. Logarithm and powers as beta's.

// log2 x, x > 0, to 1e-7 of the larger of itself and 1.
float log2_steady(float x) {
    const int k = (floatBitsToInt(x) - 0x3F3504F3) >> 23;
    const float m = intBitsToFloat(floatBitsToInt(x) - (k << 23));
    return float(k) + log2_series((m - 1.0) / (m + 1.0));
}

float exponential_log2(float x) {
    return EVALUATION == EVALUATION_BUILTIN ? log2(x) : log2_steady(x);
}

float exponential_exp2(float y) {
    return EVALUATION == EVALUATION_BUILTIN ? exp2(y) : power_of_two(y);
}

// Also dw/dt.
void exponential_value_slope(float q, float t, out float w, out float slope, out float by_exponent) {
    const float half_t = 0.5 * t;
    const float v = min(q, 1e30) + EXPONENTIAL_SOFTENING, l = exponential_log2(v);
    const float p = exponential_exp2(min(half_t * l, 7.0));  // where it is held w is below 2^-92
    const float first = exponential_exp2(half_t * EXPONENTIAL_SOFTENING_LOG2);
    w = exponential_exp2((p - first) * -0.72134752);  // log2(e)/2
    slope = -0.5 * half_t * p / v * w;
    by_exponent = -0.17328680 * w * (p * l - first * EXPONENTIAL_SOFTENING_LOG2);  // ln(2)/4
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
