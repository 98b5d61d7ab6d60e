// SPDX-License-Identifier: MIT
// Meshes of known shape: closed, and wound counter-clockwise from outside.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "engine/mesh/triangle_mesh.h"

namespace darb::test {

/// A box with corners low and high: 8 vertices, 12 faces.
inline TriangleMesh box_mesh(const glm::vec3& low, const glm::vec3& high) {
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.position.emplace_back(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y,
                                   i & 4 ? high.z : low.z);
    mesh.face = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

/// A torus around z: rings x tubes vertices, twice as many faces.
inline TriangleMesh torus_mesh(double ring, double tube, std::uint32_t rings, std::uint32_t tubes) {
    TriangleMesh mesh;
    constexpr double kTurn = 2 * std::numbers::pi;
    for (std::uint32_t i = 0; i < rings; ++i)
        for (std::uint32_t j = 0; j < tubes; ++j) {
            const double a = kTurn * i / rings, b = kTurn * j / tubes;
            const double r = ring + tube * std::cos(b);
            mesh.position.emplace_back(r * std::cos(a), r * std::sin(a), tube * std::sin(b));
            const std::uint32_t right = (i + 1) % rings, up = (j + 1) % tubes;
            const std::uint32_t p = i * tubes + j, q = right * tubes + j, r2 = right * tubes + up,
                                s = i * tubes + up;
            mesh.face.push_back({p, q, r2});
            mesh.face.push_back({p, r2, s});
        }
    return mesh;
}

/// A sphere around 0 by rings of latitude between two poles, with unit normals.
inline TriangleMesh sphere_mesh(double radius, std::uint32_t rings, std::uint32_t sectors) {
    TriangleMesh mesh;
    const auto add = [&](double theta, double phi) {
        const glm::dvec3 n(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                           std::cos(theta));
        mesh.position.emplace_back(radius * n);
        mesh.normal.emplace_back(n);
    };
    add(0, 0);
    for (std::uint32_t i = 1; i < rings; ++i)
        for (std::uint32_t j = 0; j < sectors; ++j)
            add(std::numbers::pi * i / rings, 2 * std::numbers::pi * j / sectors);
    add(std::numbers::pi, 0);
    const auto last = static_cast<std::uint32_t>(mesh.position.size() - 1);
    const auto at = [&](std::uint32_t i, std::uint32_t j) {
        return i == 0 ? 0 : i == rings ? last : 1 + (i - 1) * sectors + j % sectors;
    };
    for (std::uint32_t i = 0; i < rings; ++i)
        for (std::uint32_t j = 0; j < sectors; ++j) {
            if (i + 1 < rings) mesh.face.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            if (i > 0) mesh.face.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return mesh;
}

/// A square of z = 0 from 0 to `side`, of cells x cells squares of two faces, seen from above.
inline TriangleMesh square_mesh(float side, std::uint32_t cells) {
    TriangleMesh mesh;
    for (std::uint32_t y = 0; y <= cells; ++y)
        for (std::uint32_t x = 0; x <= cells; ++x)
            mesh.position.emplace_back(side * static_cast<float>(x) / static_cast<float>(cells),
                                       side * static_cast<float>(y) / static_cast<float>(cells),
                                       0.0f);
    for (std::uint32_t y = 0; y < cells; ++y)
        for (std::uint32_t x = 0; x < cells; ++x) {
            const std::uint32_t p = y * (cells + 1) + x, q = p + cells + 1;
            mesh.face.push_back({p, p + 1, q + 1});
            mesh.face.push_back({p, q + 1, q});
        }
    return mesh;
}

/// Adds the faces of another mesh, as they are placed.
inline void append_mesh(const TriangleMesh& other, TriangleMesh& to) {
    const auto first = static_cast<std::uint32_t>(to.vertex_count());
    to.position.insert(to.position.end(), other.position.begin(), other.position.end());
    to.normal.insert(to.normal.end(), other.normal.begin(), other.normal.end());
    to.colour.insert(to.colour.end(), other.colour.begin(), other.colour.end());
    for (const auto& face : other.face)
        to.face.push_back({face[0] + first, face[1] + first, face[2] + first});
}

}  // namespace darb::test
