// Camera: a pinhole with pose, in double. Frame: x right, y down, z forward (COLMAP's).
// The centre of the top left pixel is at (0.5, 0.5).
#pragma once

#include <glm/glm.hpp>

namespace darb {

struct Camera {
    int width = 0;                          // px
    int height = 0;                         // px
    double fx = 0, fy = 0, cx = 0, cy = 0;  // px
    glm::dmat3 rotation{1.0};  // world to camera: p_camera = rotation * p_world + translation
    glm::dvec3 translation{0.0};

    glm::dvec3 centre() const { return -(glm::transpose(rotation) * translation); }
};

}  // namespace darb
