// SPDX-License-Identifier: MIT
// The tile of a workgroup of the blends. Needs tile_range.

layout(constant_id = 10) const int LONGEST_FIRST = 0;  // 1: in the order of tile_order.comp

uvec2 own_tile() {
    if (LONGEST_FIRST == 0) return gl_WorkGroupID.xy;
    const uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    const uint tile = tile_range[gl_NumWorkGroups.x * gl_NumWorkGroups.y + group].x;
    return uvec2(tile % gl_NumWorkGroups.x, tile / gl_NumWorkGroups.x);
}
