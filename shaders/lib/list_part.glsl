// SPDX-License-Identifier: MIT
// The stretch of a tile's list that a dispatch processes. Needs the specialization constant SEGMENT: intersections per
// stretch, or 0 for whole lists in one dispatch.
uvec2 list_part(uvec2 range) {
    if (SEGMENT == 0u) return range;
    const uint begin = min(range.x + args.segment * SEGMENT, range.y);
    return uvec2(begin, min(begin + SEGMENT, range.y));
}
