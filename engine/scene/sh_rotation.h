// Rotation and reflection of spherical harmonics: the coefficients of the turned scene.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "engine/scene/sh_basis.h"

namespace darb {

/// The coefficients of band l = 1..degree transform by band[l][j][k], 2l+1 rows and columns.
using ShRotation = std::array<std::array<std::array<double, 7>, 7>, kMaxShDegree + 1>;

/// For an orthogonal matrix (determinant 1 or -1): the colour that the turned coefficients give in
/// direction turn * d is the one that the old ones give in direction d. Accurate to 1e-14.
ShRotation sh_rotation(const glm::dmat3& turn);

/// sh_rest: [N][C-1][3] as in SplatModel, degree 0 to 3.
void rotate_sh(const ShRotation& rotation, int degree, std::vector<float>& sh_rest);

}  // namespace darb
