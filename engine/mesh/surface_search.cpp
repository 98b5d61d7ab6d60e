// SPDX-License-Identifier: MIT
#include "engine/mesh/surface_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr std::uint32_t kLeafFaces = 4;

template <class Node>
double distance2_to_box(const Node& node, const glm::dvec3& p) {
    const glm::dvec3 outside =
        glm::max(glm::max(glm::dvec3(node.low) - p, p - glm::dvec3(node.high)), glm::dvec3(0.0));
    return glm::dot(outside, outside);
}

}  // namespace

// Source: Ericson, Real-Time Collision Detection, 5.1.5: the regions of Voronoi of corners and
// edges.
glm::dvec3 nearest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                               const glm::dvec3& c) {
    const glm::dvec3 ab = b - a, ac = c - a;
    const double d1 = glm::dot(ab, p - a), d2 = glm::dot(ac, p - a);
    if (d1 <= 0 && d2 <= 0) return a;
    const double d3 = glm::dot(ab, p - b), d4 = glm::dot(ac, p - b);
    if (d3 >= 0 && d4 <= d3) return b;
    const double d5 = glm::dot(ab, p - c), d6 = glm::dot(ac, p - c);
    if (d6 >= 0 && d5 <= d6) return c;
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
    if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    const double sum = va + vb + vc;
    if (!(sum > 0)) return a;  // without area, and p on it
    return a + ab * (vb / sum) + ac * (vc / sum);
}

SurfaceSearch::SurfaceSearch(const TriangleMesh& mesh) : mesh_(mesh) {
    DARB_CHECK(mesh.face_count() > 0);
    const auto count = static_cast<std::uint32_t>(mesh.face_count());
    face_.resize(count);
    std::iota(face_.begin(), face_.end(), std::uint32_t{0});
    std::vector<glm::vec3> centre(count);
    for (std::uint32_t f = 0; f < count; ++f) {
        const auto& corner = mesh.face[f];
        centre[f] =
            (mesh.position[corner[0]] + mesh.position[corner[1]] + mesh.position[corner[2]]) / 3.0f;
    }
    nodes_.reserve(count);
    nodes_.emplace_back();
    build(0, 0, count, centre);
}

void SurfaceSearch::build(std::uint32_t node, std::uint32_t first, std::uint32_t count,
                          const std::vector<glm::vec3>& centre) {
    glm::vec3 low(std::numeric_limits<float>::infinity()), high = -low;
    for (std::uint32_t i = first; i < first + count; ++i) {
        for (const std::uint32_t v : mesh_.face[face_[i]]) {
            nodes_[node].low = glm::min(nodes_[node].low, mesh_.position[v]);
            nodes_[node].high = glm::max(nodes_[node].high, mesh_.position[v]);
        }
        low = glm::min(low, centre[face_[i]]);
        high = glm::max(high, centre[face_[i]]);
    }
    const glm::vec3 extent = high - low;
    int axis = 0;
    for (int other = 1; other < 3; ++other)
        if (extent[other] > extent[axis]) axis = other;
    if (count <= kLeafFaces) {
        nodes_[node].first = first;
        nodes_[node].count = count;
        return;
    }
    const auto begin = face_.begin() + first;
    std::nth_element(
        begin, begin + count / 2, begin + count, [&](std::uint32_t a, std::uint32_t b) {
            return centre[a][axis] != centre[b][axis] ? centre[a][axis] < centre[b][axis] : a < b;
        });
    const auto left = static_cast<std::uint32_t>(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    nodes_[node].first = left;
    build(left, first, count / 2, centre);
    build(left + 1, first + count / 2, count - count / 2, centre);
}

NearestPoint SurfaceSearch::nearest(const glm::dvec3& p, double most) const {
    NearestPoint best;
    double least = most * most;
    std::uint32_t stack[128];  // halves: the depth is log2 of the number of faces
    int held = 0;
    stack[held++] = 0;
    while (held > 0) {
        const Node& node = nodes_[stack[--held]];
        if (distance2_to_box(node, p) > least) continue;
        if (node.count == 0) {
            const bool right_first = distance2_to_box(nodes_[node.first + 1], p) <
                                     distance2_to_box(nodes_[node.first], p);
            stack[held++] = node.first + (right_first ? 0 : 1);
            stack[held++] = node.first + (right_first ? 1 : 0);
            continue;
        }
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
            const auto& corner = mesh_.face[face_[i]];
            const glm::dvec3 point = nearest_on_triangle(p, glm::dvec3(mesh_.position[corner[0]]),
                                                         glm::dvec3(mesh_.position[corner[1]]),
                                                         glm::dvec3(mesh_.position[corner[2]]));
            const double square = glm::dot(point - p, point - p);
            if (square > least || (square == least && best.distance < most)) continue;
            least = square;
            best = {std::sqrt(square), point, face_[i]};
        }
    }
    return best;
}

}  // namespace darb
