// SPDX-License-Identifier: MIT
// w = (1+q)^-1 or (1+q)^-1/2, cut at R^2, and their line integrals. With x = sqrt((1+q)/(1+R^2)) and r = 1/x, the
// integrals are r acos x = r sqrt(u) P(x) and acosh r = sqrt(h) P(r - 2), h = u r/(1+x), up to a factor. Their slope
// grows without bound at the edge, where w is below any cut-off.
void quadric_integral(const KernelParameters k, float q, out float w, out float slope) {
    const float scale = 1.0 / (1.0 + k.support);
    const float v = (1.0 + q) * scale;
    const float r = 1.0 / sqrt(v), x = v * r;
    // precise: otherwise NVIDIA's compiler turns it into 1 - q / R^2, which cancels at the edge.
    precise float u = mix(1.0, (k.support - q) * k.inverse_support, q < k.support);
    const float dx = 0.5 * scale * r, dr = -dx * r * r;  // derivatives by q
    float p, dp;
    if (k.half_power == 2) {
        kernel_polynomial(k, x, p, dp);
        const float root = sqrt(u);
        w = r * root * p;
        slope = root * (dr * p + r * dp * dx) - 0.5 * k.inverse_support * r * p / root;
    } else {
        kernel_polynomial(k, r - 2.0, p, dp);
        const float root = sqrt(u * r / (1.0 + x));
        w = root * p;
        slope = dr * (root * dp + 0.5 * p * (1.0 + k.inverse_support) / root);
    }
}

void quadric_value_slope(const KernelParameters k, float q, out float w, out float slope) {
    if (FOOTPRINT == FOOTPRINT_EXACT) {
        quadric_integral(k, q, w, slope);
    } else if (k.half_power == 2) {
        w = 1.0 / (1.0 + q);
        slope = -w * w;
    } else {
        w = 1.0 / sqrt(1.0 + q);
        slope = -0.5 * w * w * w;
    }
    const bool inside = q < k.support;
    w = inside ? w : 0.0;
    slope = inside ? slope : 0.0;
}
