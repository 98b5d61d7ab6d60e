// SPDX-License-Identifier: MIT
// w = exp(-q/2) = 2^n 2^f. n is added to the exponent bits, and 2^f is P(f) on [-1/2, 1/2] with P(0) = 1 and P(1/2) = 2
// P(-1/2), so w is 1 at the centre and has no jump. Below 2^-126 it stays there. The slope -w/2 is the polynomial's
// derivative up to the polynomial's own error, which is below rounding from degree 5 on; shorter polynomials use their
// own derivative.
void gaussian_value_slope(const KernelParameters k, float q, out float w, out float slope) {
    const float y = max(q * -0.72134752, -126.0);  // -log2(e)/2
    const float n = roundEven(y);
    float p, dp;
    kernel_polynomial(k, y - n, p, dp);
    w = intBitsToFloat(floatBitsToInt(p) + (int(n) << 23));
    slope = -0.5 * w;
    if (k.degree < 5)
        slope = -0.72134752 * intBitsToFloat(floatBitsToInt(dp) + (int(n) << 23));
}
