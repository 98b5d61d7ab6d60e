// Splats that the lanes of a subgroup have loaded, one each, for all of them in turn: by broadcasts, or from shared
// memory where those are slower (the tuning's `turns`). Needs THREADS, SUBGROUP_SIZE and lib/lockstep.glsl.
layout(constant_id = 10) const int TURNS_SHARED = 0;

const uint TURNS = TURNS_SHARED == 1 ? THREADS : 1u;
shared vec4 turn_shape[TURNS], turn_light[TURNS];
shared float turn_l22[TURNS];

uint turn_at(uint lane) {
    return gl_SubgroupID * SUBGROUP_SIZE + lane;
}

// Before the first turn.
void give_turns(vec4 shape, vec4 light, float l22) {
    if (TURNS_SHARED == 0) return;
    order_within_subgroup();  // those before may still be read
    turn_shape[turn_at(gl_SubgroupInvocationID)] = shape;
    turn_light[turn_at(gl_SubgroupInvocationID)] = light;
    turn_l22[turn_at(gl_SubgroupInvocationID)] = l22;
    order_within_subgroup();
}

// Of the splat whose turn it is; mine: what give_turns was given.
vec4 shape_in_turn(vec4 mine, uint lane) {
    if (TURNS_SHARED == 1) return turn_shape[turn_at(lane)];
    return subgroupBroadcast(mine, lane);
}
vec4 light_in_turn(vec4 mine, uint lane) {
    if (TURNS_SHARED == 1) return turn_light[turn_at(lane)];
    return subgroupBroadcast(mine, lane);
}
float l22_in_turn(float mine, uint lane) {
    if (TURNS_SHARED == 1) return turn_l22[turn_at(lane)];
    return subgroupBroadcast(mine, lane);
}
// Its intersection, `at` of the subgroup's list of hits.
uint index_in_turn(uint mine, uint at, uint lane) {
    if (TURNS_SHARED == 1) return hit_index[hits_base() + at];
    return subgroupBroadcast(mine, lane);
}
