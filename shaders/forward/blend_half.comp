// SPDX-License-Identifier: MIT
// The forward blend of the accuracy setting fast16: as blend_records.comp, but pixels of a thread form pairs whose
// alpha is computed in half precision (lib/half_records.glsl). Transmittance and colours are float32.
// Place: last pass of the forward walk.
// Work, what it reads and what it writes: see forward/blend_batches.glsl. Subgroups have 4 to 32 lanes.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_explicit_arithmetic_types_float16 : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require

#define HALF_BLEND
#include "forward/blend_batches.glsl"
