// SPDX-License-Identifier: MIT
#include "engine/kernels/second_moment.h"

#include <cmath>

#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/quadrature.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb {

// With q = r^2 the area element is pi dq, and the moment per axis is half of that of q. As in
// equal_area_scale, q = end (1 - s^2) makes half powers at the edge analytic.
double rendered_second_moment(int kernel, Footprint footprint) {
    if (blend_parts(kernel)) {
        const ShapedKernel& blend = blend_kernel(kernel);
        return blend.second_moment(footprint, blend.exponent(footprint, 0));
    }
    const DerivedKernel& k = derived_kernel(kernel);
    if (!std::isfinite(k.row().support)) return 1;
    const double end = k.pulses().front().end;
    const auto integral = [&](int power) {
        return integrate_unit([&](double s) {
            const double q = end * (1 - s * s);
            return 2 * end * s * (power == 1 ? q : 1) * k.value(footprint, q);
        });
    };
    return k.covariance_scale(footprint) * integral(1) / integral(0) / 2;
}

}  // namespace darb
