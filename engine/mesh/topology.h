// SPDX-License-Identifier: MIT
// How the faces of a mesh hang together: edges, fans, rims, parts, Euler characteristic. Half-edge
// 3 f + c runs from corner c of face f to the next corner of that face.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "engine/core/union_find.h"
#include "engine/mesh/triangle_mesh.h"

namespace darb {

constexpr std::uint32_t kNoHalfEdge = std::numeric_limits<std::uint32_t>::max();

/// The next half-edge of the same face.
constexpr std::uint32_t next_half_edge(std::uint32_t half) {
    return half % 3 == 2 ? half - 2 : half + 1;
}
/// The vertex at which a half-edge begins; it ends where the next one begins.
inline std::uint32_t half_edge_start(const TriangleMesh& mesh, std::uint32_t half) {
    return mesh.face[half / 3][half % 3];
}

struct HalfEdgePairs {
    /// [3F] the half-edge that runs the other way on the neighbouring face; kNoHalfEdge on a rim.
    /// Where more than two faces meet at an edge, those are paired that hold a piece of the solid
    /// between them, so that what touches there is taken for apart.
    std::vector<std::uint32_t> twin;
    /// [3F] as above for edges of exactly two faces, whichever way these run.
    std::vector<std::uint32_t> neighbour;
    std::size_t edges = 0;
    std::size_t crowded_edges = 0;  // with more than two faces
    std::size_t turned_edges = 0;   // with two faces that run the same way
};
/// O(F log F). Faces must have three different vertices.
HalfEdgePairs pair_half_edges(const TriangleMesh& mesh);

/// The set of corners of each fan, joined through the pairs: find(3 f + c) names the fan.
UnionFind corner_fans(const TriangleMesh& mesh, const std::vector<std::uint32_t>& twin);

struct Rim {
    std::vector<std::uint32_t> half_edges;  // one after the other, around
    double length = 0;                      // world units
};
/// Closed runs of half-edges without a twin, each as long as it can be without meeting a vertex
/// twice where no two fans share one. Open runs, which only meshes that are no manifold have, are
/// left out.
std::vector<Rim> find_rims(const TriangleMesh& mesh, const std::vector<std::uint32_t>& twin);

struct Topology {
    std::size_t vertices = 0;  // that faces name
    std::size_t edges = 0, faces = 0;
    std::size_t parts = 0;      // joined by vertices
    std::size_t rim_edges = 0;  // with one face
    std::size_t rims = 0;
    std::size_t crowded_edges = 0, turned_edges = 0;  // as in HalfEdgePairs
    std::size_t pinched_vertices = 0;                 // that two fans share
    double rim_length = 0;                            // world units

    bool is_closed() const { return faces > 0 && rim_edges == 0; }
    bool is_manifold() const {
        return crowded_edges == 0 && turned_edges == 0 && pinched_vertices == 0;
    }
    /// V - E + F: 2 for a sphere, 0 for a torus.
    long euler() const {
        return static_cast<long>(vertices) - static_cast<long>(edges) + static_cast<long>(faces);
    }
    /// Handles of all parts together; only for a closed manifold.
    long genus() const { return (2 * static_cast<long>(parts) - euler()) / 2; }
};
Topology topology_of(const TriangleMesh& mesh);

/// Removes vertices that no face names, and renumbers the others in their order.
void drop_unused_vertices(TriangleMesh& mesh);

/// Twice the vector area of a face: its normal, by the right hand, times twice its area.
inline glm::dvec3 face_cross(const TriangleMesh& mesh, std::size_t face) {
    const auto& f = mesh.face[face];
    const glm::dvec3 a(mesh.position[f[0]]);
    return glm::cross(glm::dvec3(mesh.position[f[1]]) - a, glm::dvec3(mesh.position[f[2]]) - a);
}

}  // namespace darb
