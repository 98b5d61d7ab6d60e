// SPDX-License-Identifier: MIT
// darb.rasterize: turns arrays or a scene into pictures, and pictures' gradients back into theirs.
#pragma once

#include "tools/python/device.h"

namespace darb::python {

/// What is drawn besides the splats, for both ways of giving them.
struct Pictures {
    std::vector<Camera> cameras;
    std::vector<glm::vec3> backgrounds;  // [C]
    int sh_degree = -1;
    float near_plane = 0;
    int preset = 0;
    bool depth = false;

    int width() const { return cameras[0].width; }
    int height() const { return cameras[0].height; }
};

/// options: viewmats, Ks, width, height, background, sh_degree, near, accuracy, depth.
Pictures take_pictures(const py::dict& options);

/// -> (image [C,H,W,3], alpha [C,H,W], info).
py::tuple draw(PyDevice& device, KeptRenderer& kept, const Pictures& pictures);

void bind_rasterize(py::module_& module);

}  // namespace darb::python
