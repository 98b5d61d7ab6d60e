// How wide a kernel is in pictures: what merging needs to keep the spread of splats.
#pragma once

#include "engine/kernels/kernel_family.h"

namespace darb {

/// Second moment per axis of the rendered profile over the plane, as a multiple of the 2x2 block of
/// the 3D covariance: 1 for gaussian; with rings that of the first pulse. Costs about 0.1 ms.
double rendered_second_moment(int kernel, Footprint footprint);

}  // namespace darb
