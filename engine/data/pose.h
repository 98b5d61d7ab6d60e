// SPDX-License-Identifier: MIT
// Poses as files state them, checked on the way in.
#pragma once

#include <glm/glm.hpp>
#include <string>

namespace darb {

/// Converts w x y z, of any norm above 1e-6, to a rotation matrix. Throws Error(where, ...) where
/// the quaternion is zero or not finite.
glm::dmat3 rotation_from_quaternion(glm::dvec4 wxyz, const std::string& where);

/// Divides the columns by their mean length where that differs from 1 by more than 1e-3, and
/// returns whether it did. checked_rotation refuses a matrix that is then still no rotation.
bool remove_scale(glm::dmat3& matrix);

/// The rotation nearest to `matrix`. Throws Error where an entry is not finite, or the matrix
/// mirrors or is not orthonormal to 1e-3.
glm::dmat3 checked_rotation(const glm::dmat3& matrix, const std::string& where);

/// w x y z of a rotation matrix, with unit norm and w >= 0.
glm::dvec4 quaternion_from_rotation(const glm::dmat3& rotation);

/// Throws Error where the vector is not finite.
void check_position(glm::dvec3 position, const std::string& where);

}  // namespace darb
