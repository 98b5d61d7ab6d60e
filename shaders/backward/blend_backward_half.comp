// SPDX-License-Identifier: MIT
// The backward blend of the accuracy setting fast16: as blend_backward_pixels.comp, but the alpha of a pair of pixels is
// computed in half precision (lib/half_records.glsl), as blend_half.comp does it. All that follows from alpha is
// float32: transmittance, what lies behind, the numbers of a pixel and their sums. The gradient takes no account of the
// rounding.
// Place: after the loss. Source: docs/math.md, Gradients.
// Work: see blend_backward_pixels.comp.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_explicit_arithmetic_types_float16 : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require

#define HALF_BLEND
#include "backward/pixel_moments.glsl"
