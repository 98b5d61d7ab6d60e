// SPDX-License-Identifier: MIT
// Whether pixels have the sum of weight times depth beside their colour. It is a fourth plane of the picture, a fifth
// plane of its gradient after dL/d(1 - transmittance), and one more sum for each intersection. With DEPTH_SPREAD the
// sum of weight times squared depth is a fifth plane. Both sums are then of z - z0, with z0 the depth of the first
// splat in the pixel, the sixth plane: W sum(w z z) - sum(w z)^2, from which the spread of depths follows, would cancel
// in float where a surface is far away. That splat has 1/255 of the weight at least, or W less, so that what cancels is
// no more than 255 times what is left.
#ifndef DARB_DEPTH_SUM_GLSL
#define DARB_DEPTH_SUM_GLSL

layout(constant_id = 32) const int DEPTH_SUM = 0;
layout(constant_id = 35) const int DEPTH_SPREAD = 0;  // only with DEPTH_SUM

// Planes of the picture, and of its gradient.
const uint DEPTH_PLANE = 3u, SQUARE_PLANE = 4u, FIRST_DEPTH_PLANE = 5u;
const uint DEPTH_GRADIENT_PLANE = 4u, SQUARE_GRADIENT_PLANE = 5u, FIRST_DEPTH_GRADIENT_PLANE = 6u;
// An intersection's sums besides the partials: G dy dy, and dL/d(depth).
const uint RESTS = DEPTH_SUM == 1 ? 2u : 1u;

#endif
