// What one splat becomes when N of them are put in its place and the picture is to stay: the
// relocation of 3DGS-MCMC (arXiv 2404.09591, eq. 9) for any kernel.
#pragma once

#include <vector>

#include "engine/kernels/kernel_family.h"

namespace darb {

/// Opacity of each of count >= 1 equal splats (the original counted) that together let through as
/// much as one of opacity in [0, 1]: 1 - (1 - opacity)^(1/count).
double relocation_opacity(double opacity, int count);

/// What the standard deviations are multiplied by, so that the integral over a line through the
/// centre stays: integral o w / integral [1 - (1 - o' w)^count], w(t^2) the rendered profile, o'
/// the new opacity. 1 for count = 1; below 1 otherwise. About 10 us.
double relocation_scale(int kernel, Footprint footprint, double opacity, int count);

/// relocation_scale for a shader: [max_count][opacities], row count - 1, column k at opacity
/// (k + 1/2) / opacities. Of a kernel with shapes a block of these for each of SHAPE_ROWS.
std::vector<float> relocation_table(int kernel, Footprint footprint, int opacities, int max_count);

}  // namespace darb
