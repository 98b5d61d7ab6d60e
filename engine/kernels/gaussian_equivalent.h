// SPDX-License-Identifier: MIT
// The Gaussian nearest to a kernel, for viewers that know only Gaussians.
#pragma once

#include "engine/kernels/kernel_family.h"

namespace darb {

struct GaussianEquivalent {
    double covariance;  // factor on the splat's covariance; includes the footprint's scale
    double opacity;     // factor on the opacity; 1 where that is kept
    double error;       // relative L2 distance of the two profiles over the image plane
};

/// Least squares over the plane between the rendered profile and opacity * exp(-q/(2c)). Keeping
/// the opacity preserves the order of visibility; freeing it gives a closer fit.
GaussianEquivalent gaussian_equivalent(int kernel, Footprint footprint, bool keep_opacity);

}  // namespace darb
