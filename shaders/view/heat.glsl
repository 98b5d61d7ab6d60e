// SPDX-License-Identifier: MIT
// Colours of a heat map.

// Black, violet, red, orange, pale yellow: from dark to light, so that it also reads in grey.
vec3 heat(float t) {
    const vec3 stops[5] = vec3[](HEAT_STOPS(vec3));
    const float x = clamp(t, 0.0, 1.0) * 4.0;
    const int i = min(int(x), 3);
    return mix(stops[i], stops[i + 1], x - float(i));
}
