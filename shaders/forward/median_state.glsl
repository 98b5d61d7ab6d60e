// SPDX-License-Identifier: MIT
// What is known of each pixel's median depth between the passes that look for it.
layout(push_constant, scalar) uniform Push { MedianDepthArgs args; };
// [H][W] where the depth lies between, and T there. While depth_bracket.comp looks for it: T, negative once the pixel
// has ended; the least front edge; the largest depth of the splats that bring T to the level.
layout(set = 0, binding = 8, scalar) buffer Bracket { vec4 bracket[]; };
layout(set = 0, binding = 9, scalar) buffer End { uint list_end[]; };         // [H][W] of the splats that matter
layout(set = 0, binding = 10, scalar) buffer DepthOut { vec2 depth_out[]; };  // [H][W] depth, 0: no surface; opacity

const vec4 NO_BRACKET = vec4(1.0, 0.0, 1.0, 1.0);  // the depth is found, or there is no surface
const float LEAST_STEP = 1e-5;                     // of the depth: float32 holds no more within a bracket
const float UNKNOWN_LIGHT = -1.0;                  // at the end of a bracket that no walk has tested
