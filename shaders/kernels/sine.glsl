// SPDX-License-Identifier: MIT
// sin and cos from additions and multiplications alone, which Vulkan rounds correctly, for |x| up to a few turns. They
// are off by 2e-7 at most, where the built-in ones may be off by 2^-11. The nearest multiple of pi, kept as two floats,
// is taken from x; the polynomials in r^2 are Chebyshev interpolants over [-pi/2, pi/2], off by 2e-10 at most.
#ifndef DARB_SINE_GLSL
#define DARB_SINE_GLSL

// Also gives (-1)^n, where n is the multiple.
float nearest_half_turn(float x, out float sign_of_it) {
    const float n = round(x * 0.31830988618);
    sign_of_it = 1.0 - 2.0 * abs(n - 2.0 * round(0.5 * n));
    return (x - n * 3.140625) - n * 0.00096765358979;
}

float steady_sin(float x) {
    float turn;
    const float r = nearest_half_turn(x, turn), s = r * r;
    const float p = 1.0 + s * (-0.1666666662 + s * (0.008333330974 +
        s * (-0.0001984086118 + s * (2.752526998e-6 + s * -2.388921978e-8))));
    return turn * r * p;
}

float steady_cos(float x) {
    float turn;
    const float r = nearest_half_turn(x, turn), s = r * r;
    return turn * (1.0 + s * (-0.4999999936 + s * (0.04166663616 +
        s * (-0.001388836029 + s * (2.47601097e-5 + s * -2.605065796e-7)))));
}

#endif
