// SPDX-License-Identifier: MIT
// Takes a splat's parameters and a camera to the projected Cholesky factor, and to what its derivatives need. M =
// sqrt(scale) J W R diag(s), S' = M M^T + low_pass I, q = (l11 dx + l21 dy)^2 + (l22 dy)^2 (docs/math.md).
#include "lib/finite.glsl"

// The rotation matrix of a unit quaternion (w, x, y, z); column k is the splat's axis k in the world.
mat3 rotation_matrix(vec4 q) {
    const float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
                2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
                2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

// q / |q| without overflow or underflow for any norm that is not rejected. Returns false for a quaternion without a
// direction or that is not finite.
bool normalise_rotation(vec4 q, out vec4 unit, out float norm) {
    const vec4 a = abs(q);
    const float largest = max(max(a.x, a.y), max(a.z, a.w));
    const vec4 scaled = q / largest;
    const float length_scaled = sqrt(dot(scaled, scaled));
    unit = scaled / length_scaled;
    norm = largest * length_scaled;
    return magnitude_below(q, 1e30) && is_finite(norm) && norm * norm > ROTATION_MIN_SQUARE;
}

vec3 to_camera(CameraData camera, vec3 v) {
    return vec3(dot(camera.row0, v), dot(camera.row1, v), dot(camera.row2, v));
}
// The vector from the camera's centre to p, both in the world. The difference is taken before the rotation, so that it
// is exact even where p is far from the world's origin.
vec3 from_centre(CameraData camera, vec3 p) {
    return (p - camera.centre) - camera.centre_rest;
}
vec3 to_world(CameraData camera, vec3 v) {
    return camera.row0 * v.x + camera.row1 * v.y + camera.row2 * v.z;
}

#include "lib/half.glsl"

struct Factor {
    float l11, l21, l22;
    float a, c;         // the diagonal of S'
    float shrink;       // a power of two that brings the rows of M below 2 px; 1 up to ROW_LIMIT
    float determinant;  // determinant of S', times shrink^4
};

// 2^-k where 2^k is the leading bit of the longest entry, if that is beyond ROW_LIMIT; otherwise 1.
float row_shrink(vec3 r1, vec3 r2) {
    const vec3 most = max(abs(r1), abs(r2));
    const float longest = max(most.x, max(most.y, most.z));
    return longest > ROW_LIMIT
               ? uintBitsToFloat((254u << 23) - (floatBitsToUint(longest) & 0x7F800000u))
               : 1.0;
}

float inverse_of_power(float power) {  // exact for powers of two
    return uintBitsToFloat((254u << 23) - floatBitsToUint(power));
}

// The factor as it is stored in half precision, and the diagonal of the covariance that belongs to it. Splats wider
// than 16,000 px are cut there.
void round_factor(inout Factor f) {
    f.l11 = max(round_half(f.l11), HALF_LEAST);
    f.l21 = round_half(f.l21);
    f.l22 = max(round_half(f.l22), HALF_LEAST);
    f.c = 1.0 / (f.l22 * f.l22);
    f.a = (f.l21 * f.l21 + f.l22 * f.l22) * f.c / (f.l11 * f.l11);
}

// r1, r2: rows of M. The determinant in product form has no cancellation. Its fourth powers exceed float32 for splats
// beyond 1e9 px, so long rows are factored after shrinking, which is exact.
Factor cholesky_factor(vec3 r1, vec3 r2, float low_pass) {
    Factor f;
    f.shrink = row_shrink(r1, r2);
    r1 *= f.shrink;
    r2 *= f.shrink;
    const float h = low_pass * f.shrink * f.shrink, grow = inverse_of_power(f.shrink);
    const float n1 = dot(r1, r1), n2 = dot(r2, r2), b = dot(r1, r2);
    const vec3 across = cross(r1, r2);
    const float c = n2 + h, l22 = inversesqrt(c);
    f.a = (n1 + h) * grow * grow;
    f.c = c * grow * grow;
    f.determinant = dot(across, across) + h * (n1 + n2) + h * h;
    f.l11 = sqrt(c / f.determinant) * f.shrink;
    f.l22 = l22 * f.shrink;
    f.l21 = -b * l22 * inversesqrt(f.determinant) * f.shrink;
    if (STORAGE == STORAGE_FLOAT16) round_factor(f);
    return f;
}
