// SPDX-License-Identifier: MIT
// The anti-aliasing of Mip-Splatting (Yu et al. 2024): the opacity takes back what blurring adds to a splat's light,
// both by the low-pass in the image (equation 10) and by the 3D filter in the world (equation 9). Needs
// covariance.glsl.

// sqrt(det S / det(S + low_pass I)) with S = M M^T, r1 and r2 the rows of M.
float compensation(vec3 r1, vec3 r2, Factor f) {
    return length(cross(r1 * f.shrink, r2 * f.shrink)) * inversesqrt(f.determinant);
}

// Its gradient in the whitened rows of factor_gradient. d_peak: dL/d(compensation). With M^+ the pseudo-inverse, d
// ln(compensation) = low_pass (S'^-1 M^+T) : dM, without the cancellation between the two determinants.
void add_compensation_gradient(Factor f, vec3 r1, vec3 r2, float low_pass, float d_peak,
                               inout vec3 p1, inout vec3 p2) {
    r1 *= f.shrink;
    r2 *= f.shrink;
    const vec3 across = cross(r1, r2);
    const float area = length(across);
    if (!(area > 0.0)) return;  // no area, no light: the splat was culled
    const float g = d_peak * low_pass * f.shrink * inversesqrt(f.determinant);
    const vec3 u1 = cross(r2, across / area), u2 = cross(across / area, r1);
    p1 += g * (f.l11 * u1 + f.l21 * u2);
    p2 += g * (f.l22 * u2);
}

// Widens the standard deviations by the filter's and returns the factor that this takes from the peak. share: the
// splat's own part of each widened variance.
float smooth_scale(inout vec3 s, float deviation, out vec3 share) {
    const vec3 wide = sqrt(s * s + deviation * deviation);
    const vec3 kept = s / wide;
    s = wide;
    share = kept * kept;
    return kept.x * kept.y * kept.z;
}
