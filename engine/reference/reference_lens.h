// SPDX-License-Identifier: MIT
// Lens distortion in double with hand-derived derivatives of first and second order; the terms are
// those of engine/scene/camera.h.
#pragma once

#include "engine/reference/splats.h"
#include "engine/scene/camera.h"

namespace darb::reference {

template <class T>
struct LensPoint {
    Vec2<T> value{0};     // distorted ray
    Mat2<T> jacobian{1};  // [column][row]: d value_row / d ray_column
    bool seen = true;     // false beyond the fold
};
template <class T>
LensPoint<T> lens_point(const LensTerms& lens, const Vec2<T>& ray);

/// dL/d(ray) from dL/d(jacobian), with the same layout.
template <class T>
Vec2<T> lens_jacobian_backward(const LensTerms& lens, const Vec2<T>& ray,
                               const Mat2<T>& d_jacobian);

/// The rays between which the projection's Jacobian is taken: those of the frame, widened by
/// JACOBIAN_MARGIN.
struct RayBounds {
    glm::dvec2 low{0.0}, high{0.0};
};
RayBounds ray_bounds(const Camera& camera);

}  // namespace darb::reference
