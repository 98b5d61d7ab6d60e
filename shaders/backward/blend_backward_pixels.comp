// SPDX-License-Identifier: MIT
// Computes the same gradients as blend_backward_team.comp, but reduces nothing while splats are walked. All sums of a
// splat follow from a few numbers of each pixel times constants of the pixel. So these numbers go to shared memory, and
// after BATCH splats the subgroup turns: each lane then takes a splat and a part of the block's pixels.
// Place: after the loss. Source: docs/math.md, Gradients.
// The numbers of a pixel are G, which is dL/dq up to a factor of the splat, and W = alpha T. Without LOG_FORM
// (lib/log_form.glsl) there are also dL/d(alpha) w and dL/d(exponent). The sums of a splat are the moments of G about
// the block's centre, from which those of x and dy follow, and W times dL/dcolour.
// Work: one workgroup per tile, and one subgroup of 4 to 32 lanes per block of it, with two pixels or more for each
// lane. Shared memory: the numbers of a batch, the tile's dL/dcolour, the chunk's sums; two barriers per chunk. Every
// intersection of the list is written once, with zeros where nothing reaches it, so that the slots need not be zero
// before.
// Lists that are too long for one dispatch are processed as in blend_backward.comp.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require

#include "backward/pixel_moments.glsl"
