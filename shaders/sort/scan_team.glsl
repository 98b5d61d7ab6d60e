// SPDX-License-Identifier: MIT
// Teams of the scan: each team owns CHUNK contiguous elements. On GPUs a team is a subgroup, so that neighbouring lanes
// touch neighbouring words. On lavapipe it is one thread, because there a loop in registers is far cheaper than a
// subgroup scan. Only the speed depends on the subgroup size: teams stride over the chunks by the number of teams that
// really run.
layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 32;
layout(constant_id = 1) const uint CHUNK = 256;
layout(constant_id = 2) const bool TEAM_IS_THREAD = true;

uint team_lanes() { return TEAM_IS_THREAD ? 1 : gl_SubgroupSize; }
uint team_lane() { return TEAM_IS_THREAD ? 0 : gl_SubgroupInvocationID; }
uint first_team() {
    return TEAM_IS_THREAD ? gl_GlobalInvocationID.x
                          : gl_WorkGroupID.x * gl_NumSubgroups + gl_SubgroupID;
}
uint team_count() {
    return gl_NumWorkGroups.x * (TEAM_IS_THREAD ? THREADS : gl_NumSubgroups);
}
