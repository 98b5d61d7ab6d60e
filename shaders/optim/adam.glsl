// SPDX-License-Identifier: MIT
// One Adam step of one parameter (Kingma and Ba 2015, bias correction as in PyTorch). moment = (first, second), and the
// result goes back into it. A pass with betas of its own defines them before including this.

#ifndef ADAM_BETA1
#define ADAM_BETA1 0.9
#define ADAM_BETA2 0.999
#define ADAM_SHARE1 (1.0 - ADAM_BETA1)
#define ADAM_SHARE2 (1.0 - ADAM_BETA2)
#endif
const float ADAM_EPSILON = 1e-15;

float adam_step(float parameter, inout vec2 moment, float gradient, float rate) {
    moment.x = ADAM_BETA1 * moment.x + ADAM_SHARE1 * gradient;
    moment.y = ADAM_BETA2 * moment.y + ADAM_SHARE2 * gradient * gradient;
    return parameter -
           rate * moment.x / (sqrt(moment.y) * args.inverse_sqrt_correction2 + ADAM_EPSILON);
}

// The steps of several parameters at once, with as many pairs of moments.
struct Moments3 { vec4 first; vec2 last; };
vec3 adam_step(vec3 parameter, inout Moments3 moments, vec3 gradient, float rate) {
    parameter.x = adam_step(parameter.x, moments.first.xy, gradient.x, rate);
    parameter.y = adam_step(parameter.y, moments.first.zw, gradient.y, rate);
    parameter.z = adam_step(parameter.z, moments.last, gradient.z, rate);
    return parameter;
}
vec4 adam_step(vec4 parameter, inout mat2x4 moments, vec4 gradient, float rate) {
    parameter.x = adam_step(parameter.x, moments[0].xy, gradient.x, rate);
    parameter.y = adam_step(parameter.y, moments[0].zw, gradient.y, rate);
    parameter.z = adam_step(parameter.z, moments[1].xy, gradient.z, rate);
    parameter.w = adam_step(parameter.w, moments[1].zw, gradient.w, rate);
    return parameter;
}

