// Real spherical harmonics of degree 0 to 3 in the order and with the signs of 3DGS: the basis and
// its derivative with respect to the direction.
#pragma once

#include <array>

#include "engine/reference/splats.h"
#include "engine/scene/sh_basis.h"

namespace darb::reference {

template <class T>
using ShBasis = std::array<T, kMaxShCoefficients>;
template <class T>
using ShBasisGradient = std::array<Vec3<T>, kMaxShCoefficients>;

/// basis[k] for k < (degree + 1)^2, 0 beyond; direction is of unit length. Colour before the
/// clamp is 0.5 + sum over k of basis[k] * coefficient[k].
template <class T>
ShBasis<T> sh_basis(int degree, const Vec3<T>& direction);

/// d basis[k] / d direction, of the polynomials in x, y, z as 3DGS writes them. Off the unit sphere
/// they are one continuation among many: project on the tangent plane before use.
template <class T>
ShBasisGradient<T> sh_basis_gradient(int degree, const Vec3<T>& direction);

}  // namespace darb::reference
