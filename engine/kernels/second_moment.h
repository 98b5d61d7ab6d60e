// SPDX-License-Identifier: MIT
// How wide a kernel is in pictures, which merging needs to preserve the spread of splats.
#pragma once

#include "engine/kernels/kernel_family.h"

namespace darb {

/// The second moment per axis of the rendered profile over the plane, relative to the 2x2 block of
/// the 3D covariance: 1 for gaussian; with several pulses, that of the first. Takes about 0.1 ms.
double rendered_second_moment(int kernel, Footprint footprint);

}  // namespace darb
