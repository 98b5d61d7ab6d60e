// SPDX-License-Identifier: MIT
// The splats that a page holds, each in the words of a texel of some layers: position in float32, all else in as many
// bits as its rounding leaves. engine/publish/page_shader.cpp writes the functions that take them apart.
uniform usampler2DArray words;

bool stored_at(out ivec2 at) {
    at = ivec2(gl_FragCoord.xy);
    return true;
}
// The three smaller components of a unit quaternion, and which one is missing.
vec4 whole_turn(vec4 q) {
    float whole = sqrt(max(0.0, 1.0 - dot(q.xyz, q.xyz)));
    int largest = int(q.w + 0.5);
    return largest == 0 ? vec4(whole, q.xyz) : largest == 1 ? vec4(q.x, whole, q.yz) : largest == 2 ? vec4(q.xy, whole, q.z) : vec4(q.xyz, whole);
}
