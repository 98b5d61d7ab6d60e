// SPDX-License-Identifier: MIT
// dL/d(camera) along the ways in which a camera can change: three turns about its own axes, the
// translation, focal lengths, principal point; and turn and move of a shutter that rolls.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "engine/reference/reference_render.h"
#include "engine/render/render_gradients.h"

namespace darb::test {

inline int freedoms(const Camera& camera) {
    return camera.shutter.active ? 16 : 10;
}

/// dL along a move, from the gradient by the camera's numbers.
inline double along(const CameraGradient& d, const Camera& camera, int which) {
    if (which >= 13) return d.d_move[which - 13];
    if (which >= 10) return d.d_turn[which - 10];
    if (which >= 6) return std::array{d.d_fx, d.d_fy, d.d_cx, d.d_cy}[size_t(which) - 6];
    if (which >= 3) return d.d_translation[which - 3];
    glm::dmat3 generator(0.0);  // generator of the rotation about that axis
    const int j = (which + 1) % 3, k = (which + 2) % 3;
    generator[j][k] = 1;
    generator[k][j] = -1;
    const glm::dmat3 d_rotation = generator * camera.rotation;
    double sum = glm::dot(d.d_translation, generator * camera.translation);
    for (int c = 0; c < 3; ++c) sum += glm::dot(d.d_rotation[c], d_rotation[c]);
    return sum;
}

inline std::vector<double> along_all(const CameraGradient& d, const Camera& camera) {
    std::vector<double> all;
    for (int which = 0; which < freedoms(camera); ++which) all.push_back(along(d, camera, which));
    return all;
}

inline CameraGradient as_device(const reference::CameraGradients<double>& d) {
    return {d.d_rotation,    d.d_translation, d.d_focal.x, d.d_focal.y,
            d.d_principal.x, d.d_principal.y, d.d_turn,    d.d_move};
}

}  // namespace darb::test
