// SPDX-License-Identifier: MIT
// Moves a reference onto a mesh where the two are not in one frame: iterated closest points, with
// the distance along the normal of the nearest face as the residual (Chen and Medioni 1991), and
// the farthest samples left out of each step.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string_view>

#include "engine/mesh/triangle_mesh.h"

namespace darb {

enum class AlignKind {
    rigid,      // turn and move
    similarity  // scale as well
};
std::optional<AlignKind> align_kind_from_name(std::string_view name);

/// p' = scale rotation p + shift, world units.
struct Alignment {
    double scale = 1;
    glm::dmat3 rotation{1.0};
    glm::dvec3 shift{0.0};
    double degrees = 0;  // by which it turns
    double moved = 0;    // how far the middle of the reference goes, world units
    /// Mean distance to the mesh of the nearest 90 % of the reference, world units.
    double before = 0, after = 0;

    glm::dvec3 apply(const glm::dvec3& p) const { return scale * (rotation * p) + shift; }
};

/// The motion that brings the reference, a mesh or points, nearest to the mesh. It finds turns of
/// some 30 degrees, and any distance and scale where the two show the same; beyond that, only the
/// nearest fit. spacing: between samples of the reference, which are at most 20,000. Deterministic.
/// Both must have vertices, and the mesh faces.
Alignment align_to_mesh(const TriangleMesh& mesh, const TriangleMesh& reference, AlignKind kind,
                        double spacing);

/// The mesh where the alignment takes it, with its normals.
TriangleMesh moved_mesh(const Alignment& alignment, TriangleMesh mesh);

}  // namespace darb
