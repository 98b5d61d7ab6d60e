// The Gaussian nearest to a kernel, for viewers that know only Gaussians.
#pragma once

#include "engine/kernels/kernel_family.h"

namespace darb {

struct GaussianEquivalent {
    double covariance;  // multiplies the covariance of the splat, the footprint's scale included
    double opacity;     // multiplies the opacity; 1 where it is kept
    double error;       // relative L2 distance of the two profiles over the image plane
};

/// Least squares over the plane between the rendered profile and opacity * exp(-q/(2c)). Keeping
/// the opacity keeps the order of visibility; freeing it comes nearer.
GaussianEquivalent gaussian_equivalent(int kernel, Footprint footprint, bool keep_opacity);

}  // namespace darb
