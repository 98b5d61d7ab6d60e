// SPDX-License-Identifier: MIT
// Cameras in gsplat's form: viewmats [C,4,4], world to camera, and Ks [C,3,3].
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "engine/scene/camera.h"
#include "tools/python/arguments.h"

namespace darb::python {

/// Throws Error for a matrix that is not a rigid motion, or a K that is not a pinhole without skew.
std::vector<Camera> take_cameras(const py::object& viewmats, const py::object& Ks, int width,
                                 int height);
/// None means black; [3] is for all cameras, or [C,3]; sequences of three numbers work, too.
std::vector<glm::vec3> take_backgrounds(const py::object& background, std::size_t count);

/// The reverse, in float64.
py::array viewmat_of(const Camera& camera);     // [4,4]
py::array intrinsics_of(const Camera& camera);  // [3,3]

}  // namespace darb::python
