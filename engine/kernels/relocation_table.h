// SPDX-License-Identifier: MIT
// What a splat becomes when N splats take its place without changing the picture: the relocation of
// 3DGS-MCMC (arXiv 2404.09591, eq. 9) for any kernel.
#pragma once

#include <vector>

#include "engine/kernels/kernel_family.h"

namespace darb {

/// The opacity of each of `count` >= 1 equal splats (the original included) that together let
/// through as much light as one with this opacity in [0, 1]: 1 - (1 - opacity)^(1/count).
double relocation_opacity(double opacity, int count);

/// The factor on the standard deviations that preserves the integral along a line through the
/// centre: integral o w / integral [1 - (1 - o' w)^count], with w(t^2) the rendered profile and o'
/// the new opacity. It is 1 for count = 1 and below 1 otherwise. Takes about 10 us.
double relocation_scale(int kernel, Footprint footprint, double opacity, int count);

/// relocation_scale for a shader: [max_count][opacities], with row count - 1 and column k for
/// opacity (k + 1/2) / opacities. For a kernel with shapes, one such block for each of SHAPE_ROWS.
std::vector<float> relocation_table(int kernel, Footprint footprint, int opacities, int max_count);

}  // namespace darb
