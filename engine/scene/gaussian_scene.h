// SPDX-License-Identifier: MIT
// Converts a scene with another kernel to Gaussians, for viewers that know only these.
#pragma once

#include "engine/kernels/gaussian_equivalent.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Replaces scales and opacities by those of the Gaussian nearest to the scene's kernel (least
/// squares over the image plane; gaussian_equivalent.h); everything else stays. Opacities are
/// limited to 0.999. A Gaussian scene is returned unchanged. *fit: what was used; for a kernel with
/// shapes, the means over the splats, weighted by opacity.
SplatModel as_gaussians(const SplatModel& model, bool keep_opacity,
                        GaussianEquivalent* fit = nullptr);

}  // namespace darb
