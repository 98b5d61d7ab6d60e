// SPDX-License-Identifier: MIT
// Whether pixels have the sum of weight times depth beside their colour. It is a fourth plane of the picture, a fifth
// plane of its gradient after dL/d(1 - transmittance), and one more sum for each intersection.
#ifndef DARB_DEPTH_SUM_GLSL
#define DARB_DEPTH_SUM_GLSL

layout(constant_id = 32) const int DEPTH_SUM = 0;

const uint DEPTH_PLANE = 3u;           // plane of the picture
const uint DEPTH_GRADIENT_PLANE = 4u;  // plane of its gradient
// An intersection's sums besides the partials: G dy dy, and dL/d(depth).
const uint RESTS = DEPTH_SUM == 1 ? 2u : 1u;

#endif
