// SPDX-License-Identifier: MIT
// The splats that a page holds: a texel each of some textures.
uniform sampler2D place;       // position, opacity
uniform sampler2D turn;        // unit quaternion w x y z
uniform sampler2D size;        // natural logarithms of the standard deviations
uniform sampler2D tint;        // sh_dc
uniform sampler2DArray light;  // sh_rest, a layer a coefficient

bool stored_at(out ivec2 at) {
    at = ivec2(gl_FragCoord.xy);
    return true;
}
vec4 stored_place(ivec2 at) {
    return texelFetch(place, at, 0);
}
vec3 stored_size(ivec2 at) {
    return texelFetch(size, at, 0).xyz;
}
vec4 stored_turn(ivec2 at) {
    return texelFetch(turn, at, 0);
}
vec3 stored_dc(ivec2 at) {
    return texelFetch(tint, at, 0).rgb;
}
vec3 stored_rest(ivec2 at, int k) {
    return texelFetch(light, ivec3(at, k), 0).rgb;
}
