// SPDX-License-Identifier: MIT
// The form `records` of blend.comp, for devices where every instruction counts: splats come from shared memory
// (lib/records.glsl), and ends are not tested before the first pixel of the block ends.
// Place: last pass of the forward walk.
// Work, what it reads and what it writes: see forward/blend_batches.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require

#include "forward/blend_batches.glsl"
