// SPDX-License-Identifier: MIT
// Panoramas: pictures of all directions around a point, as 360-degree cameras take them
// (equirectangular). A panorama is cut into the six faces of a cube, or joined from them. Each face
// is a pinhole's view of 90 degrees, so that every pass, kernel and effect works on panoramas as it
// does on photos.
//
// In the panorama's frame x points right, y down and z forward, and the direction (x, y, z) is at
//   column  width (1/2 + atan2(x, z) / 2 pi),   row  height (1/2 + asin(y) / pi),
// which is COLMAP's EQUIRECTANGULAR and nerfstudio's.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <span>
#include <string_view>

#include "engine/core/image.h"
#include "engine/scene/camera.h"

namespace darb {

struct CubeFace {
    std::string_view name;
    glm::dmat3 rotation;  // of the panorama's frame into the face's: p_face = rotation * p
};

inline constexpr int kCubeFaces = 6;
/// back, down, front, left, right, up: in the order of their names.
const std::array<CubeFace, kCubeFaces>& cube_faces();

/// The side of a face, in px, whose middle shows as many pixels a degree as the panorama's horizon.
int face_size(int panorama_width);

/// The unit direction of a point of a panorama, (0, 0) being its top left corner, and the reverse.
/// px.
glm::dvec2 panorama_pixel(const glm::dvec3& direction, int width, int height);
glm::dvec3 panorama_direction(const glm::dvec2& pixel, int width, int height);

/// The camera of a face of size x size px, with `margin` more pixels on each side, where `camera`
/// has the panorama's pose.
Camera face_camera(const Camera& camera, const CubeFace& face, int size, int margin = 0);

/// A face of a panorama, size x size, with straight alpha. rgba: 4 channels; bilinear, and the two
/// vertical borders are neighbours. Throws Error for other channels or an empty picture.
ImageU8 cut_face(const ImageU8& rgba, const CubeFace& face, int size);

/// The panorama of width x height whose faces these are, in the order of cube_faces(): squares of
/// one size with kJoinMargin px of margin, and the channels of the first. A pixel is the mean of
/// four bilinear samples. Throws Error where the faces differ in shape.
inline constexpr int kJoinMargin = 1;
ImageF join_faces(std::span<const ImageF, kCubeFaces> faces, int width, int height);

}  // namespace darb
