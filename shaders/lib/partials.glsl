// SPDX-License-Identifier: MIT
// The sums of splat-tile intersections, PARTIALS floats each, in the order of the intersections' slots. blend_backward
// adds to them (define PARTIALS_PUT as +=), blend_backward_team sets them (as =), blend_backward_pixels sets four at a
// time (PARTIALS_PUT_FOURS), partial_chunks both sets and reads them (PARTIALS_GET), and others read them. Where one binding cannot hold them, the buffer is bound in
// PARTIAL_WINDOWS windows of WINDOW_INTERSECTIONS intersections each, from PARTIALS_BINDING on.

layout(constant_id = 9) const uint WINDOW_INTERSECTIONS = 0;  // 0: the first window has them all

#ifdef PARTIALS_PUT
#define PARTIALS_WINDOW(number) layout(set = 0, binding = PARTIALS_BINDING + number, scalar) buffer
#define PARTIALS_OF float
#elif defined(PARTIALS_PUT_FOURS)
#define PARTIALS_WINDOW(number) layout(set = 0, binding = PARTIALS_BINDING + number, scalar) writeonly buffer
#define PARTIALS_OF vec4
#else
#define PARTIALS_WINDOW(number) layout(set = 0, binding = PARTIALS_BINDING + number, scalar) readonly buffer
#define PARTIALS_OF vec4
#endif
PARTIALS_WINDOW(0) Partials0 { PARTIALS_OF partials0[]; };
PARTIALS_WINDOW(1) Partials1 { PARTIALS_OF partials1[]; };
PARTIALS_WINDOW(2) Partials2 { PARTIALS_OF partials2[]; };
PARTIALS_WINDOW(3) Partials3 { PARTIALS_OF partials3[]; };
PARTIALS_WINDOW(4) Partials4 { PARTIALS_OF partials4[]; };

// The window of a slot; the slot becomes the number within the window.
uint partial_window(inout uint slot) {
    if (WINDOW_INTERSECTIONS == 0u) return 0u;
    const uint window = slot / max(WINDOW_INTERSECTIONS, 1u);
    slot -= window * WINDOW_INTERSECTIONS;
    return window;
}

#ifdef PARTIALS_PUT
void put_partial(uint slot, uint i, float value) {
    const uint window = partial_window(slot), at = slot * PARTIALS + i;
    if (WINDOW_INTERSECTIONS == 0u || window == 0u) partials0[at] PARTIALS_PUT value;
    else if (window == 1u) partials1[at] PARTIALS_PUT value;
    else if (window == 2u) partials2[at] PARTIALS_PUT value;
    else if (window == 3u) partials3[at] PARTIALS_PUT value;
    else partials4[at] PARTIALS_PUT value;
}
#ifdef PARTIALS_GET
float get_partial(uint slot, uint i) {
    const uint window = partial_window(slot), at = slot * PARTIALS + i;
    if (WINDOW_INTERSECTIONS == 0u || window == 0u) return partials0[at];
    if (window == 1u) return partials1[at];
    if (window == 2u) return partials2[at];
    if (window == 3u) return partials3[at];
    return partials4[at];
}
#endif
#elif defined(PARTIALS_PUT_FOURS)
// part: as for load_partial.
void put_four(uint slot, uint part, vec4 value) {
    const uint window = partial_window(slot), at = 2u * slot + part;
    if (WINDOW_INTERSECTIONS == 0u || window == 0u) partials0[at] = value;
    else if (window == 1u) partials1[at] = value;
    else if (window == 2u) partials2[at] = value;
    else if (window == 3u) partials3[at] = value;
    else partials4[at] = value;
}
#else
// part: 0 for the first four of an intersection's sums, or 1 for the others.
vec4 load_partial(uint slot, uint part) {
    const uint window = partial_window(slot), at = 2u * slot + part;
    if (WINDOW_INTERSECTIONS == 0u || window == 0u) return partials0[at];
    if (window == 1u) return partials1[at];
    if (window == 2u) return partials2[at];
    if (window == 3u) return partials3[at];
    return partials4[at];
}
#endif
