// SPDX-License-Identifier: MIT
// The point of a mesh that is nearest to a given one: a tree of boxes over the faces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

#include "engine/mesh/triangle_mesh.h"

namespace darb {

struct NearestPoint {
    double distance = std::numeric_limits<double>::infinity();  // world units
    glm::dvec3 point{0.0};
    std::uint32_t face = 0;
};

/// Built in O(F log F); a search takes O(log F) near the surface. Searches may run side by side.
class SurfaceSearch {
  public:
    /// Keeps a reference to the mesh, which must have faces.
    explicit SurfaceSearch(const TriangleMesh& mesh);

    /// p: in the mesh's frame, relative to its origin. Of equally near faces the first in the tree,
    /// which depends on the mesh alone. No face beyond `most` is looked for; the distance is
    /// infinite where there is none.
    NearestPoint nearest(const glm::dvec3& p,
                         double most = std::numeric_limits<double>::infinity()) const;

  private:
    struct Node {
        glm::vec3 low{std::numeric_limits<float>::infinity()};
        glm::vec3 high{-std::numeric_limits<float>::infinity()};
        std::uint32_t first = 0;  // of face_ in a leaf; else the left child, the right one follows
        std::uint32_t count = 0;  // faces of a leaf; 0: no leaf
    };
    void build(std::uint32_t node, std::uint32_t first, std::uint32_t count,
               const std::vector<glm::vec3>& centre);

    const TriangleMesh& mesh_;
    std::vector<Node> nodes_;
    std::vector<std::uint32_t> face_;
};

/// The point of the triangle a b c that is nearest to p.
glm::dvec3 nearest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                               const glm::dvec3& c);

}  // namespace darb
