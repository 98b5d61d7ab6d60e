// SPDX-License-Identifier: MIT
// A raw surface becomes one that programs take: faces without area, small parts, pinched vertices
// and small holes go, and the number of faces can be reduced.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "engine/mesh/triangle_mesh.h"

namespace darb {

struct CleanOptions {
    std::size_t keep = 0;       // so many parts, those with the largest areas; 0: all
    std::size_t min_faces = 0;  // a part with fewer faces is removed
    double min_extent = 0;      // so is one whose box is shorter on all sides, world units
    double longest_rim = 0;     // a hole whose rim is shorter than this is filled; 0: none
    /// Whether a hole may be filled with these triangles, in the mesh's frame: false where a camera
    /// looks through it. Empty: any may be.
    std::function<bool(std::span<const std::array<glm::vec3, 3>> triangles)> may_fill = {};
    /// Turns faces so that neighbours agree.
    bool orient = false;
    /// Which way a face looks: positive where its side of `normal` is outside, negative where the
    /// other one is, 0 where it cannot be said. A part is turned as its faces, by area, ask. Empty:
    /// as most of its area was turned before.
    std::function<double(const glm::vec3& point, const glm::vec3& normal)> outside = {};
};

struct CleanReport {
    std::size_t faces_without_area = 0;
    std::size_t parts = 0, parts_removed = 0, part_faces_removed = 0;
    std::size_t faces_turned = 0;
    std::size_t edges_not_turned = 0;  // whose faces disagree on a surface with one side
    std::size_t vertices_split = 0;    // added by splitting
    std::size_t holes_filled = 0, faces_filled = 0;
    std::size_t holes_forbidden = 0;  // by may_fill
    std::size_t holes_left = 0;       // with a longer rim, or without a fill that keeps a manifold
};

/// In this order:
///   1. faces without area: vertices in one place become one, and an edge on which a vertex lies is
///      turned to end there, so that no crack opens;
///   2. parts that are too small, or not among the `keep` largest;
///   3. where asked, neighbours are turned to agree;
///   4. vertices that two fans share are split, and edges of more than two faces, so that the
///   result
///      is a manifold wherever neighbours agree;
///   5. holes are filled with the triangulation of least area (Barequet and Sharir 1995).
/// Normals follow the faces' side. The mesh may be empty afterwards.
CleanReport clean_mesh(TriangleMesh& mesh, const CleanOptions& options);

/// Step 4 alone. Returns the number of vertices that were added.
std::size_t split_into_manifold(TriangleMesh& mesh);

/// Whether darb was built with meshoptimizer.
bool can_simplify();

struct Simplified {
    TriangleMesh mesh;
    double largest_distance = 0;  // of a vertex of the full mesh to `mesh`, world units
};
/// Collapses edges by the quadric error until at most `faces` are left, or until no edge can go.
/// Rims keep their lines as surfaces keep their shapes; a closed manifold stays one. Throws Error
/// that names the package where darb was built without meshoptimizer.
Simplified simplify_mesh(const TriangleMesh& mesh, std::size_t faces);

}  // namespace darb
