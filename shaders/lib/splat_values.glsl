// SPDX-License-Identifier: MIT
// The meaning of a splat's floats. In files and in training they are the logit of the opacity, logarithms of scales,
// and harmonics of a colour that is clamped at 0. With LINEAR_VALUES they are the opacity and the scales themselves, as
// callers of renderers pass them. With DIRECT_COLOUR, sh_dc is the colour, of any sign, and there are no other
// harmonics.

layout(constant_id = 210) const int LINEAR_VALUES = 0;
layout(constant_id = 211) const int DIRECT_COLOUR = 0;

float opacity_of(float stored) {
    if (LINEAR_VALUES == 1) return clamp(stored, 0.0, 1.0);
    return 1.0 / (1.0 + exp(-clamp(stored, -OPACITY_LOGIT_LIMIT, OPACITY_LOGIT_LIMIT)));
}

vec3 scale_of(vec3 stored) {
    if (LINEAR_VALUES == 1) return clamp(stored, exp(-LOG_SCALE_LIMIT), exp(LOG_SCALE_LIMIT));
    return exp(clamp(stored, -LOG_SCALE_LIMIT, LOG_SCALE_LIMIT));
}

// The first band, and the least value of the sum of all bands.
vec3 first_band(vec3 dc) { return DIRECT_COLOUR == 1 ? dc : 0.5 + SH_C0 * dc; }
vec3 shown_colour(vec3 sum) { return DIRECT_COLOUR == 1 ? sum : max(sum, 0.0); }
