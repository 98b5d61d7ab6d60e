// SPDX-License-Identifier: MIT
// The unscented projection in double: six points, sqrt(3) standard deviations from a splat's centre
// along its axes, each through the camera. Their mean and covariance are those of the footprint.
// Also the footprint that both projections approximate, integrated along the rays of pixels.
#pragma once

#include "engine/reference/projection.h"

namespace darb::reference {

/// terms: with the rows of the Jacobian at the mean and the motion of the shutter. axis: one
/// standard deviation along each of the splat's axes, in the camera. used is false where the splat
/// is left to the Jacobian.
template <class T>
SigmaTerms<T> sigma_terms(const Vec3<T>& mean, const std::array<Vec3<T>, 3>& axis,
                          const CovarianceTerms<T>& terms, const Camera& camera, int projection);

template <class T>
struct SigmaGradients {
    Vec3<T> d_mean{0};  // of the centre in the camera, at held axes
    std::array<Vec3<T>, 3> d_axis{Vec3<T>(0), Vec3<T>(0), Vec3<T>(0)};
    Vec2<T> d_shear{0}, d_focal{0};
};

/// d_cov: dL/d(xx, xy, yy); d_shift: dL/d(mean in the picture). Zero where the points are not used.
template <class T>
SigmaGradients<T> sigma_backward(const Vec3<T>& mean, const SigmaTerms<T>& sigma,
                                 const Camera& camera, const Vec3<T>& d_cov,
                                 const Vec2<T>& d_shift);

/// The light of a splat at a pixel over that at its centre: the kernel integrated along the ray of
/// the pixel through the exact camera, without a low-pass. The lens is inverted by Newton's method.
/// Of a camera without shutter. 0 where no ray leads to the pixel.
double integrated_footprint(const Splats<double>& splats, size_t index, const Camera& camera,
                            const glm::dvec2& pixel);

}  // namespace darb::reference
