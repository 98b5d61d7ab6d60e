// SPDX-License-Identifier: MIT
// What a truncated signed distance loses: depths that no part of the mesh is near.
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>

#include "engine/mesh/scene_mesh.h"

namespace darb {

namespace {

constexpr int kEvery = 3;          // pixels, each way
constexpr double kCell = 2;        // voxels
constexpr double kMostPixel = 8;   // voxels, as blocks of the surface have it
constexpr std::size_t kLeast = 3;  // depths that a block must have lost

std::uint64_t key_of(const glm::dvec3& cell) {
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis)
        key = key << 21 |
              (static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[axis])) & 0x1FFFFF);
    return key;
}

/// The cells of two voxels that have a vertex of the mesh.
std::unordered_set<std::uint64_t> cells_of(const TriangleMesh& mesh, double side) {
    std::unordered_set<std::uint64_t> cells;
    for (const glm::vec3& p : mesh.position) cells.insert(key_of(glm::floor(glm::dvec3(p) / side)));
    return cells;
}

bool is_near(const std::unordered_set<std::uint64_t>& cells, const glm::dvec3& cell) {
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x)
                if (cells.count(key_of(cell + glm::dvec3(x, y, z)))) return true;
    return false;
}

struct LostDepths {
    std::size_t count = 0;
    glm::dvec3 first{0.0};  // direction from which the first was seen
    bool both_sides = false;
};

}  // namespace

double share_of_thin_blocks(const std::vector<DepthView>& views, const TriangleMesh& mesh,
                            const TsdfOptions& options) {
    const double cell = kCell * options.voxel, block = BLOCK_SIDE * options.voxel;
    const auto cells = cells_of(mesh, cell);
    const glm::dvec3 origin(mesh.origin[0], mesh.origin[1], mesh.origin[2]);
    std::unordered_map<std::uint64_t, LostDepths> blocks;
    for (const DepthView& view : views) {
        const Camera& c = view.camera;
        const glm::dmat3 to_world = glm::transpose(c.rotation);
        const glm::dvec3 centre = c.centre() - origin;
        for (int y = kEvery / 2; y < c.height; y += kEvery)
            for (int x = kEvery / 2; x < c.width; x += kEvery) {
                const double z = view.depth[std::size_t(y) * std::size_t(c.width) + std::size_t(x)];
                if (!(z > 0) || z > options.farthest ||
                    z > kMostPixel * options.voxel * std::min(c.fx, c.fy))
                    continue;
                const glm::dvec3 ray =
                    to_world * glm::dvec3((x + 0.5 - c.cx) / c.fx, (y + 0.5 - c.cy) / c.fy, 1);
                const glm::dvec3 p = centre + z * ray;
                if (options.bounds && (glm::any(glm::lessThan(p, options.bounds->low)) ||
                                       glm::any(glm::greaterThan(p, options.bounds->high))))
                    continue;
                LostDepths& lost = blocks[key_of(glm::floor(p / block))];
                if (is_near(cells, glm::floor(p / cell))) continue;
                if (lost.count++ == 0) lost.first = ray;
                lost.both_sides = lost.both_sides || glm::dot(lost.first, ray) < 0;
            }
    }
    std::size_t thin = 0;
    for (const auto& [key, lost] : blocks) thin += lost.count >= kLeast && lost.both_sides;
    return blocks.empty() ? 0 : static_cast<double>(thin) / static_cast<double>(blocks.size());
}

}  // namespace darb
