// SPDX-License-Identifier: MIT
// The tiles of the loss, and which one a workgroup has. A row of workgroups has the channels of each tile side by side.

struct Tile {
    int channel;
    int left, top;  // px
    uint work;  // the tile's number among all
};

Tile tile_of() {
    const uvec2 group = gl_WorkGroupID.xy;
    return Tile(int(group.x % 3u), int(group.x / 3u) * LOSS_TILE, int(group.y) * LOSS_TILE,
                group.y * gl_NumWorkGroups.x + group.x);
}
