// SPDX-License-Identifier: MIT
// TriangleMesh: a surface as an indexed list of triangles, on the host, and its texture.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "engine/core/image.h"

namespace darb {

/// V vertices and F faces. Axes and units are those of the splats that the surface came from; like
/// theirs, positions are relative to `origin`, so that float32 is enough far from the world's.
/// Per-vertex arrays other than `position` are either empty or of V elements.
struct TriangleMesh {
    std::array<double, 3> origin{};                  // added to every position, world units
    std::vector<glm::vec3> position;                 // [V]
    std::vector<glm::vec3> normal;                   // [V] unit length, out of the solid
    std::vector<glm::u8vec3> colour;                 // [V] sRGB
    std::vector<std::array<std::uint32_t, 3>> face;  // [F] indices, counter-clockwise from outside

    std::size_t vertex_count() const { return position.size(); }
    std::size_t face_count() const { return face.size(); }
};

/// A texture on F faces. A vertex between two charts has several places on the pages, so they are
/// given by face. (0, 0) is the top left corner of a page, (1, 1) its bottom right one.
struct MeshTexture {
    std::vector<std::array<glm::vec2, 3>> uv;  // [F] of the corners of the face
    std::vector<std::uint32_t> page;           // [F]
    std::vector<ImageU8> image;                // [pages] sRGB, 3 channels
};

}  // namespace darb
