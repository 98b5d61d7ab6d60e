// SPDX-License-Identifier: MIT
// Comparisons by the bits that hold for NaN and infinity on every device. SPIR-V as compiled here promises nothing
// about them, and drivers that assume that there are none (fast math of Metal, LLPC) may turn !(x < y) into x >= y and
// isnan(x) into false. Without their sign, the bits are ordered as the magnitudes, then infinity, then NaN.
#ifndef DARB_FINITE_GLSL
#define DARB_FINITE_GLSL

const uint MAGNITUDE_BITS = 0x7FFFFFFFu, INFINITY_BITS = 0x7F800000u;

bool is_nan(float x) { return (floatBitsToUint(x) & MAGNITUDE_BITS) > INFINITY_BITS; }
bool any_nan(vec3 x) { return is_nan(x.x) || is_nan(x.y) || is_nan(x.z); }

uint magnitude(float x) { return floatBitsToUint(x) & MAGNITUDE_BITS; }
uint magnitude(vec3 x) { return max(max(magnitude(x.x), magnitude(x.y)), magnitude(x.z)); }
uint magnitude(vec4 x) { return max(magnitude(x.xyz), magnitude(x.w)); }

// Whether the magnitude of every part is below the positive limit; false for NaN.
bool below(uint largest_magnitude, float limit) { return largest_magnitude < floatBitsToUint(limit); }
bool magnitude_below(float x, float limit) { return below(magnitude(x), limit); }
bool magnitude_below(vec3 x, float limit) { return below(magnitude(x), limit); }
bool magnitude_below(vec4 x, float limit) { return below(magnitude(x), limit); }
bool is_finite(float x) { return magnitude(x) < INFINITY_BITS; }

// x, at most `largest`; NaN stays NaN. A comparison alone would not do: NVIDIA's compiler turns x > largest ? largest :
// x into a minimum, and the minimum of NaN and a number is the number.
float at_most(float x, float largest) { return is_nan(x) ? x : min(x, largest); }
vec3 at_most(vec3 x, vec3 largest) {
    return vec3(at_most(x.x, largest.x), at_most(x.y, largest.y), at_most(x.z, largest.z));
}

#endif
