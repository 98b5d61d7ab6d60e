// SPDX-License-Identifier: MIT
// The splats of a chunk of streamed SOG (engine/scene/sog.h): a pixel each of its pictures.
uniform sampler2D means_l;
uniform sampler2D means_u;
uniform sampler2D quats;
uniform sampler2D scales;
uniform sampler2D sh0;
uniform sampler2D labels;
uniform sampler2D palette;  // 64 entries a row, a pixel a coefficient
uniform sampler2D books;    // codebooks of 256: scales, sh0, shN
uniform vec3 mins;
uniform vec3 maxs;
uniform int columns;  // of the level
uniform int shift;    // from the number of a texel of the level to that of the splat in the chunk
uniform int count;    // splats of the chunk
uniform int terms;    // coefficients of an entry of the palette

bool stored_at(out ivec2 at) {
    int i = int(gl_FragCoord.y) * columns + int(gl_FragCoord.x) - shift;
    int width = textureSize(means_l, 0).x;
    at = ivec2(i % width, i / width);
    return i < count;
}
vec4 bytes_of(vec4 texel) {
    return floor(texel * 255.0 + 0.5);
}
// A series where the difference would cancel.
float exp_less_one(float x) {
    return x < 0.25 ? x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x / 120.0)))) : exp(x) - 1.0;
}
vec4 stored_place(ivec2 at) {
    vec3 part = (bytes_of(texelFetch(means_l, at, 0)).rgb + 256.0 * bytes_of(texelFetch(means_u, at, 0)).rgb) / 65535.0;
    vec3 folded = mins + (maxs - mins) * part, x = abs(folded);
    return vec4(sign(folded) * vec3(exp_less_one(x.x), exp_less_one(x.y), exp_less_one(x.z)), texelFetch(sh0, at, 0).a);
}
vec3 entries_of(vec4 texel, int book) {
    ivec3 k = ivec3(bytes_of(texel).rgb);
    return vec3(texelFetch(books, ivec2(k.r, 0), 0)[book], texelFetch(books, ivec2(k.g, 0), 0)[book],
                texelFetch(books, ivec2(k.b, 0), 0)[book]);
}
vec3 stored_size(ivec2 at) {
    return entries_of(texelFetch(scales, at, 0), 0);
}
vec4 stored_turn(ivec2 at) {
    vec4 pixel = bytes_of(texelFetch(quats, at, 0));
    vec3 q = (pixel.rgb / 127.5 - 1.0) * 0.70710678;
    float whole = sqrt(max(0.0, 1.0 - dot(q, q)));
    if (pixel.a == 252.0) return vec4(whole, q);
    if (pixel.a == 253.0) return vec4(q.x, whole, q.yz);
    if (pixel.a == 254.0) return vec4(q.xy, whole, q.z);
    return pixel.a == 255.0 ? vec4(q, whole) : vec4(1.0, 0.0, 0.0, 0.0);
}
vec3 stored_dc(ivec2 at) {
    return entries_of(texelFetch(sh0, at, 0), 1);
}
vec3 stored_rest(ivec2 at, float basis[SH_REST_MAX]) {
    vec3 sum = vec3(0.0);
    ivec2 bytes = ivec2(bytes_of(texelFetch(labels, at, 0)).rg);
    int label = bytes.r + 256 * bytes.g;
    for (int k = 0; k < min(terms, SH_REST_MAX); ++k)
        sum += basis[k] * entries_of(texelFetch(palette, ivec2(label % 64 * terms + k, label / 64), 0), 2);
    return sum;
}
