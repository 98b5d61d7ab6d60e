// SPDX-License-Identifier: MIT
#include "engine/mesh/topology.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <unordered_map>

#include "engine/core/error.h"

namespace darb {

namespace {

struct EdgeOfFace {
    std::uint32_t low, high;  // vertices
    std::uint32_t half;
    friend bool operator<(const EdgeOfFace& a, const EdgeOfFace& b) {
        return a.low != b.low     ? a.low < b.low
               : a.high != b.high ? a.high < b.high
                                  : a.half < b.half;
    }
    bool same_edge(const EdgeOfFace& other) const { return low == other.low && high == other.high; }
};

std::vector<EdgeOfFace> sorted_edges(const TriangleMesh& mesh) {
    DARB_CHECK(mesh.face_count() < kNoHalfEdge / 3, "{} faces", mesh.face_count());
    std::vector<EdgeOfFace> edges(3 * mesh.face_count());
    for (std::uint32_t half = 0; half < edges.size(); ++half) {
        const std::uint32_t a = half_edge_start(mesh, half),
                            b = half_edge_start(mesh, next_half_edge(half));
        edges[half] = {std::min(a, b), std::max(a, b), half};
    }
    std::sort(edges.begin(), edges.end());
    return edges;
}

bool runs_up(const TriangleMesh& mesh, const EdgeOfFace& edge) {
    return half_edge_start(mesh, edge.half) == edge.low;
}

void pair(std::uint32_t a, std::uint32_t b, std::vector<std::uint32_t>& twin) {
    twin[a] = b;
    twin[b] = a;
}

/// Around an edge, by angle, a face that runs down opens a wedge of solid and one that runs up
/// closes it: the angle grows towards the outside of the latter.
void pair_crowd(const TriangleMesh& mesh, std::span<const EdgeOfFace> crowd,
                std::vector<std::uint32_t>& twin) {
    const glm::dvec3 base(mesh.position[crowd[0].low]);
    const glm::dvec3 along = glm::dvec3(mesh.position[crowd[0].high]) - base;
    int least = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (std::abs(along[axis]) < std::abs(along[least])) least = axis;
    glm::dvec3 aside(0.0);
    aside[least] = 1;
    const glm::dvec3 v = glm::cross(along, aside), u = glm::cross(v, along);
    const double scale = glm::length(along);
    struct Around {
        double angle;
        bool up;
        std::uint32_t half;
    };
    std::vector<Around> around;
    for (const EdgeOfFace& edge : crowd) {
        const std::uint32_t tip = half_edge_start(mesh, next_half_edge(next_half_edge(edge.half)));
        const glm::dvec3 to = glm::dvec3(mesh.position[tip]) - base;
        around.push_back(
            {std::atan2(glm::dot(to, v) * scale, glm::dot(to, u)), runs_up(mesh, edge), edge.half});
    }
    std::stable_sort(around.begin(), around.end(),
                     [](const Around& a, const Around& b) { return a.angle < b.angle; });
    std::vector<std::uint32_t> open;
    for (int turn = 0; turn < 2; ++turn)  // a wedge may contain the angle where counting begins
        for (const Around& one : around) {
            if (twin[one.half] != kNoHalfEdge) continue;
            if (!one.up) {
                if (turn == 0) open.push_back(one.half);
            } else if (!open.empty()) {
                pair(open.back(), one.half, twin);
                open.pop_back();
            }
        }
}

}  // namespace

HalfEdgePairs pair_half_edges(const TriangleMesh& mesh) {
    const std::vector<EdgeOfFace> edges = sorted_edges(mesh);
    HalfEdgePairs pairs;
    pairs.twin.assign(edges.size(), kNoHalfEdge);
    pairs.neighbour.assign(edges.size(), kNoHalfEdge);
    for (std::size_t begin = 0, end; begin < edges.size(); begin = end) {
        for (end = begin + 1; end < edges.size() && edges[end].same_edge(edges[begin]);) ++end;
        ++pairs.edges;
        if (end - begin > 2) {
            ++pairs.crowded_edges;
            pair_crowd(mesh, std::span(edges).subspan(begin, end - begin), pairs.twin);
        } else if (end - begin == 2) {
            const EdgeOfFace &a = edges[begin], &b = edges[begin + 1];
            pair(a.half, b.half, pairs.neighbour);
            if (runs_up(mesh, a) != runs_up(mesh, b))
                pair(a.half, b.half, pairs.twin);
            else
                ++pairs.turned_edges;
        }
    }
    return pairs;
}

UnionFind corner_fans(const TriangleMesh& mesh, const std::vector<std::uint32_t>& twin) {
    UnionFind fans(3 * mesh.face_count());
    for (std::uint32_t half = 0; half < twin.size(); ++half) {
        if (twin[half] == kNoHalfEdge) continue;
        fans.join(half, next_half_edge(twin[half]));
        fans.join(next_half_edge(half), twin[half]);
    }
    return fans;
}

std::vector<Rim> find_rims(const TriangleMesh& mesh, const std::vector<std::uint32_t>& twin) {
    std::unordered_multimap<std::uint32_t, std::uint32_t> starts;
    std::vector<std::uint32_t> open;
    for (std::uint32_t half = 0; half < twin.size(); ++half)
        if (twin[half] == kNoHalfEdge) open.push_back(half);
    for (auto half = open.rbegin(); half != open.rend(); ++half)
        starts.emplace(half_edge_start(mesh, *half), *half);
    std::vector<bool> used(twin.size(), false);
    std::vector<Rim> rims;
    for (const std::uint32_t first : open) {
        if (used[first]) continue;
        Rim rim;
        for (std::uint32_t half = first; half != kNoHalfEdge && !used[half];) {
            used[half] = true;
            rim.half_edges.push_back(half);
            const std::uint32_t end = half_edge_start(mesh, next_half_edge(half));
            rim.length += glm::distance(glm::dvec3(mesh.position[half_edge_start(mesh, half)]),
                                        glm::dvec3(mesh.position[end]));
            half = kNoHalfEdge;
            const auto range = starts.equal_range(end);
            for (auto at = range.first; at != range.second; ++at)
                if (!used[at->second]) half = std::min(half, at->second);
        }
        const std::uint32_t last = rim.half_edges.back();
        if (half_edge_start(mesh, next_half_edge(last)) == half_edge_start(mesh, first))
            rims.push_back(std::move(rim));
    }
    return rims;
}

Topology topology_of(const TriangleMesh& mesh) {
    const HalfEdgePairs pairs = pair_half_edges(mesh);
    Topology topology;
    topology.faces = mesh.face_count();
    topology.edges = pairs.edges;
    topology.crowded_edges = pairs.crowded_edges;
    topology.turned_edges = pairs.turned_edges;
    for (std::uint32_t half = 0; half < pairs.twin.size(); ++half)
        if (pairs.twin[half] == kNoHalfEdge && pairs.neighbour[half] == kNoHalfEdge)
            ++topology.rim_edges;
    for (const Rim& rim : find_rims(mesh, pairs.twin)) {
        ++topology.rims;
        topology.rim_length += rim.length;
    }
    UnionFind fans = corner_fans(mesh, pairs.twin), parts(mesh.vertex_count());
    std::vector<std::uint32_t> fan(mesh.vertex_count(), kNoHalfEdge);
    std::vector<bool> pinched(mesh.vertex_count(), false);
    for (std::uint32_t half = 0; half < pairs.twin.size(); ++half) {
        const std::uint32_t v = half_edge_start(mesh, half);
        if (fan[v] == kNoHalfEdge) {
            fan[v] = fans.find(half);
            ++topology.vertices;
        } else if (fan[v] != fans.find(half)) {
            pinched[v] = true;
        }
        parts.join(v, half_edge_start(mesh, next_half_edge(half)));
    }
    topology.pinched_vertices =
        static_cast<std::size_t>(std::count(pinched.begin(), pinched.end(), true));
    for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v)
        if (fan[v] != kNoHalfEdge && parts.find(v) == v) ++topology.parts;
    return topology;
}

void drop_unused_vertices(TriangleMesh& mesh) {
    std::vector<std::uint32_t> number(mesh.vertex_count(), 0);
    for (const auto& face : mesh.face)
        for (const std::uint32_t v : face) number[v] = 1;
    std::uint32_t kept = 0;
    for (std::uint32_t v = 0; v < number.size(); ++v) {
        if (number[v] == 0) continue;
        mesh.position[kept] = mesh.position[v];
        if (!mesh.normal.empty()) mesh.normal[kept] = mesh.normal[v];
        if (!mesh.colour.empty()) mesh.colour[kept] = mesh.colour[v];
        number[v] = kept++;
    }
    mesh.position.resize(kept);
    if (!mesh.normal.empty()) mesh.normal.resize(kept);
    if (!mesh.colour.empty()) mesh.colour.resize(kept);
    for (auto& face : mesh.face)
        for (std::uint32_t& v : face) v = number[v];
}

}  // namespace darb
