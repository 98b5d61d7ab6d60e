// What a rendered profile alone gives, of kernels with tables and of those in closed form: w(q) on
// [0, support], the support finite or that of a Gaussian below rounding.
#pragma once

#include <functional>

#include "engine/kernels/gaussian_equivalent.h"

namespace darb {

/// relocation_scale of this profile; radius: the square root of its support, or where a Gaussian is
/// below rounding.
double relocation_scale_of(const std::function<double(double)>& w, double support, double opacity,
                           int count);
/// gaussian_equivalent of a profile with this support, whose covariance is multiplied by `scale`.
GaussianEquivalent gaussian_equivalent_of(const std::function<double(double)>& w, double support,
                                          double scale, bool keep_opacity);

}  // namespace darb
