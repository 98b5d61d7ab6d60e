// SPDX-License-Identifier: MIT
// A linear thread index over a dispatch of groups_x * groups_y groups (engine/primitives/groups.h splits counts
// that exceed one dimension's limit). THREADS is the including shader's local size.
uint linear_id() {
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * THREADS +
           gl_LocalInvocationID.x;
}
