// SPDX-License-Identifier: MIT
// The order of shared memory accesses among the threads of a subgroup. With LOCKSTEP 1 the threads are lanes of one
// vector, as on lavapipe, and need no barrier among them. lavapipe of Mesa 25.0 turns a subgroup barrier into one of
// the whole workgroup, and loses the subgroups that go on after another has ended.
#ifndef DARB_LOCKSTEP_GLSL
#define DARB_LOCKSTEP_GLSL

layout(constant_id = 5) const int LOCKSTEP = 0;

void order_within_subgroup() {
    subgroupMemoryBarrierShared();
    if (LOCKSTEP == 0) subgroupBarrier();
}

#endif
