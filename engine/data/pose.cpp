// SPDX-License-Identifier: MIT
#include "engine/data/pose.h"

#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr double kTolerance = 1e-3;  // files with four decimals pass
constexpr const char* kFixPose = "Remove this photo from the file or calibrate it again.";

bool finite(const glm::dmat3& matrix) {
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            if (!std::isfinite(matrix[c][r])) return false;
    return true;
}

}  // namespace

glm::dmat3 rotation_from_quaternion(glm::dvec4 wxyz, const std::string& where) {
    const double norm = glm::length(wxyz);
    if (!std::isfinite(norm)) throw Error(where, "the rotation quaternion is not finite", kFixPose);
    if (!(norm > 1e-6)) throw Error(where, "the rotation quaternion is zero", kFixPose);
    wxyz /= norm;
    return glm::mat3_cast(glm::dquat(wxyz[0], wxyz[1], wxyz[2], wxyz[3]));
}

bool remove_scale(glm::dmat3& matrix) {
    const double scale =
        (glm::length(matrix[0]) + glm::length(matrix[1]) + glm::length(matrix[2])) / 3;
    if (!(scale > 0) || !(std::abs(scale - 1) > kTolerance)) return false;
    matrix /= scale;
    return true;
}

glm::dmat3 checked_rotation(const glm::dmat3& matrix, const std::string& where) {
    if (!finite(matrix)) throw Error(where, "the pose holds NaN or infinity", kFixPose);
    const glm::dmat3 product = glm::transpose(matrix) * matrix;
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            if (!(std::abs(product[c][r] - (c == r ? 1.0 : 0.0)) <= kTolerance))
                throw Error(where, "the rotation part of the pose is not orthonormal", kFixPose);
    if (!(glm::determinant(matrix) > 0))
        throw Error(where, "the rotation part of the pose mirrors (determinant -1)", kFixPose);
    glm::dmat3 rotation = matrix;  // Newton iteration of the polar decomposition
    for (int i = 0; i < 4; ++i)
        rotation = 0.5 * (rotation + glm::transpose(glm::inverse(rotation)));
    return rotation;
}

glm::dvec4 quaternion_from_rotation(const glm::dmat3& rotation) {
    const glm::dquat q = glm::normalize(glm::quat_cast(rotation));
    const glm::dvec4 wxyz(q.w, q.x, q.y, q.z);
    return q.w < 0 ? -wxyz : wxyz;
}

void check_position(glm::dvec3 position, const std::string& where) {
    if (!std::isfinite(position.x + position.y + position.z))
        throw Error(where, "the position of the camera is not finite", kFixPose);
}

}  // namespace darb
