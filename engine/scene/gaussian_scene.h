// A scene of another kernel as Gaussians, for viewers that know nothing else.
#pragma once

#include "engine/kernels/gaussian_equivalent.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Scales and opacities of the Gaussian nearest to the scene's kernel (least squares over the image
/// plane; gaussian_equivalent.h); the rest stays. An opacity that would pass 0.999 stops there.
/// A Gaussian scene is returned as it is. *fit: what was used; of a kernel with shapes the means
/// over the splats, each weighted by its opacity.
SplatModel as_gaussians(const SplatModel& model, bool keep_opacity,
                        GaussianEquivalent* fit = nullptr);

}  // namespace darb
