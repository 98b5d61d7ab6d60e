// SPDX-License-Identifier: MIT
// A closed mesh of few faces for programs that move bodies: made from how full of matter the cells
// of a grid are, with the cameras as places that must be free. All points are in one frame, that of
// the splats, and so is the mesh; its origin is for the caller to set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "engine/mesh/triangle_mesh.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Cubic cells in a box whose third axis is up.
struct VoxelGrid {
    glm::dmat3 axes{1.0};     // columns: the axes in the world, at right angles, of length 1
    glm::dvec3 low{0.0};      // the corner of cell (0, 0, 0), along these axes
    double cell = 0;          // side, world units
    glm::ivec3 size{0};       // cells
    std::vector<float> full;  // [z][y][x] 0 to 1, at the middle of the cell

    std::size_t index(const glm::ivec3& at) const {
        return (static_cast<std::size_t>(at.z) * static_cast<std::size_t>(size.y) +
                static_cast<std::size_t>(at.y)) *
                   static_cast<std::size_t>(size.x) +
               static_cast<std::size_t>(at.x);
    }
    glm::dvec3 middle(const glm::ivec3& at) const {
        return axes * (low + cell * (glm::dvec3(at) + 0.5));
    }
};

/// Axes whose third one is `up`, of any length but 0.
glm::dmat3 upright_axes(const glm::dvec3& up);

/// An empty grid over the box from low to high, along the axes. Throws Error where it would have
/// more than 2^28 cells.
VoxelGrid make_grid(const glm::dmat3& axes, const glm::dvec3& low, const glm::dvec3& high,
                    double cell);

/// Fills a grid with density(world point), 0 to 1, at the middles of its cells. Called on several
/// threads at once.
void fill_grid(const std::function<double(const glm::dvec3& point)>& density, VoxelGrid& grid);

/// Fills a grid with 1 - product over the splats of (1 - opacity f(q3)), q3 the squared Mahalanobis
/// distance in space and f the kernel's profile. No deviation counts as less than half a cell, so
/// that walls of flat splats have no holes, and a splat counts where its centre is, at least.
void fill_grid(const SplatModel& splats, VoxelGrid& grid);

enum class ColliderKind {
    room,    // all that a capsule does not reach from the cameras is solid
    ground,  // so is what lies below something solid, but for what a capsule reaches
    object   // so is what neither the outside nor a camera reaches
};
std::optional<ColliderKind> collider_kind_from_name(std::string_view name);

struct ColliderOptions {
    ColliderKind kind = ColliderKind::room;
    double level = 0.1;        // a cell is solid from here on
    std::size_t faces = 5000;  // at most, unless a camera would end within something solid
    /// The capsule that moves from the cameras, its upper middle at the eye: world units.
    double radius = 0.2, height = 1.6;
};

/// Faces turn towards what is free. Closed, and a manifold. Throws Error where nothing is solid, or
/// nothing free, and where darb was built without meshoptimizer and there are more faces.
TriangleMesh make_collider(const VoxelGrid& grid, const std::vector<glm::dvec3>& cameras,
                           const ColliderOptions& options);

/// Whether the point lies within what a collider takes for solid; for a room, also beyond it.
/// O(faces).
bool is_in_solid(const TriangleMesh& collider, ColliderKind kind, const glm::dvec3& point);

}  // namespace darb
