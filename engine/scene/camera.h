// SPDX-License-Identifier: MIT
// Camera: a pinhole with its pose, in double, and optionally a lens before it, for pictures that
// are to be distorted like the photo, and a shutter that rolls. Frame: x right, y down, z forward
// (COLMAP's). The centre of the top left pixel is at (0.5, 0.5).
#pragma once

#include <array>
#include <glm/glm.hpp>

namespace darb {

/// Lens distortion of the plane z = 1. A ray u = (x/z, y/z) first becomes w = u a(|u|), with
/// a(r) = atan(front_tan r) / (front_scale r) (fisheye and FOV; w = u where front_scale is 0), or
/// with a negative front_scale a(r) = 1 / (alpha sqrt(1 + beta r^2) + 1 - alpha), alpha =
/// -front_scale and beta = front_tan (EUCM and the division models); then
///   v = w (1 + k0 s + .. + k5 s^6) / (1 + d0 s + d1 s^2 + d2 s^3), s = |w|^2,
///   w' = v + tangential (2 p0 x y + p1 (t + 2 x^2), 2 p1 x y + p0 (t + 2 y^2)) + prism t
///        + prism_high t^2, with (x, y) = w or, with `after`, v, and t its squared length.
/// Source: the camera models of COLMAP, see engine/data/lens_model.h.
struct LensTerms {
    bool active = false;  // false: a pinhole
    double front_tan = 0, front_scale = 0;
    std::array<double, 6> k{};
    std::array<double, 3> d{};
    glm::dvec2 tangential{0.0}, prism{0.0}, prism_high{0.0};
    bool after = false;
    double fold = 0;                        // largest |w| that the lens maps one to one
    glm::dvec2 ray_min{0.0}, ray_max{0.0};  // bounds of the rays of the frame
};

/// A rolling shutter: the rows of a picture are exposed one after the other while the camera moves.
/// The time t of a row is -1/2 at the top edge and 1/2 at the bottom. With p_camera a point in the
/// camera of the middle row, the camera of that time has it at
///   p_camera(t) = exp(t turn) (p_camera - t move).
struct ShutterTerms {
    bool active = false;   // false: all rows at once
    glm::dvec3 turn{0.0};  // of the world over the read-out, rad, in the camera of the middle row
    glm::dvec3 move{0.0};  // of the camera's centre over it, in the same axes; world units
};

struct Camera {
    int width = 0;                          // px
    int height = 0;                         // px
    double fx = 0, fy = 0, cx = 0, cy = 0;  // px
    glm::dmat3 rotation{1.0};  // world to camera: p_camera = rotation * p_world + translation
    glm::dvec3 translation{0.0};
    LensTerms lens{};
    ShutterTerms shutter{};

    glm::dvec3 centre() const { return -(glm::transpose(rotation) * translation); }
};

}  // namespace darb
