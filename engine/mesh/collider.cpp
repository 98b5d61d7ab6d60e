// SPDX-License-Identifier: MIT
#include "engine/mesh/collider.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/on_threads.h"
#include "engine/kernels/kernel_family.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/mesh/clean.h"

namespace darb {

namespace {

using glm::dvec3;
using glm::ivec3;

constexpr double kMostCells = 268435456;  // 2^28: a GiB of floats
constexpr double kCutOff = 1.0 / 255;     // what a splat leaves less of is nothing

// What a splat leaves.

/// The splat's profile in space: 3D, by its own footprint.
class SpaceProfile {
  public:
    SpaceProfile(const SplatModel& model, std::size_t splat) : kernel_(model.kernel) {
        opacity = sigmoid(model.opacity_logit[splat]);
        if (kernel_has_shape(kernel_)) {
            shaped_ = &shaped_kernel(kernel_);
            exponent_ = shaped_->exponent(Footprint::psi, model.shape[splat]);
            covariance = shaped_->covariance_scale(
                model.footprint, shaped_->exponent(model.footprint, model.shape[splat]));
            reach = shaped_->reach(Footprint::psi, exponent_, opacity, kCutOff);
        } else {
            covariance = covariance_scale(kernel_, model.footprint);
            reach = kernel_reach(kernel_, Footprint::psi, opacity, kCutOff);
        }
    }
    double value(double q) const {
        return shaped_ ? shaped_->value(Footprint::psi, exponent_, q).w
                       : kernel_value(kernel_, Footprint::psi, q);
    }
    double opacity = 0, covariance = 1;
    double reach = 0;  // the q beyond which nothing is left

  private:
    int kernel_;
    const ShapedKernel* shaped_ = nullptr;
    double exponent_ = 0;
};

/// Multiplies what is open in the cells that the splat reaches.
void add_splat(const SplatModel& model, std::size_t splat, VoxelGrid& grid) {
    const SpaceProfile profile(model, splat);
    if (!(profile.opacity > kCutOff)) return;
    const float* q = &model.rotation[4 * splat];
    const glm::dquat turn(q[0], q[1], q[2], q[3]);
    if (!(glm::length(turn) > 1e-6)) return;
    const glm::dmat3 axes =
        glm::transpose(grid.axes) * glm::mat3_cast(glm::normalize(turn));  // in the grid's frame
    dvec3 deviation(1.0), half(0.0);
    for (int k = 0; k < 3; ++k) {
        // A flat splat between the middles of cells would leave a hole in a wall of such splats.
        deviation[k] = std::max(std::exp(double{model.log_scale[3 * splat + std::size_t(k)]}) *
                                    std::sqrt(profile.covariance),
                                grid.cell / 2);
        half += axes[k] * axes[k] * (deviation[k] * deviation[k]);
    }
    half = glm::sqrt(half * profile.reach);
    const float* p = &model.position[3 * splat];
    const dvec3 centre =
        (glm::transpose(grid.axes) * dvec3(p[0], p[1], p[2]) - grid.low) / grid.cell - 0.5;
    const dvec3 nearest = glm::round(centre);
    const dvec3 low = glm::max(glm::min(glm::ceil(centre - half / grid.cell), nearest), dvec3(0.0)),
                high = glm::min(glm::max(glm::floor(centre + half / grid.cell), nearest),
                                dvec3(grid.size - 1));
    if (!(low.x <= high.x && low.y <= high.y && low.z <= high.z)) return;
    for (int z = int(low.z); z <= int(high.z); ++z)
        for (int y = int(low.y); y <= int(high.y); ++y)
            for (int x = int(low.x); x <= int(high.x); ++x) {
                const dvec3 local = (dvec3(x, y, z) - centre) * grid.cell * axes / deviation;
                const bool own = dvec3(x, y, z) == nearest;  // though it may be smaller than a cell
                const double square = own ? 0 : glm::dot(local, local);
                if (!(square <= profile.reach)) continue;
                float& open = grid.full[grid.index({x, y, z})];
                open *= static_cast<float>(1 - profile.opacity * profile.value(square));
            }
}

// Sets of cells.

struct Cells {
    ivec3 size{0};
    std::vector<std::uint8_t> in;  // [z][y][x]

    explicit Cells(const ivec3& cells, std::uint8_t value = 0) : size(cells) {
        in.assign(std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z), value);
    }
    std::size_t index(const ivec3& at) const {
        return (std::size_t(at.z) * std::size_t(size.y) + std::size_t(at.y)) * std::size_t(size.x) +
               std::size_t(at.x);
    }
    bool holds(const ivec3& at) const {
        return at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x < size.x && at.y < size.y &&
               at.z < size.z;
    }
};

template <class Visit>
void for_each_cell(const ivec3& size, const Visit& visit) {
    for (int z = 0; z < size.z; ++z)
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x) visit(ivec3(x, y, z));
}

/// The cells whose middles are closer than `radius` cells to that of one in the set: by axes, with
/// squares of distances that end at the radius.
Cells grown_by_ball(const Cells& set, double radius) {
    const int reach = static_cast<int>(std::ceil(radius));
    constexpr std::uint16_t kFar = 65535;
    std::vector<std::uint16_t> square(set.in.size()), next(set.in.size());
    for (std::size_t i = 0; i < square.size(); ++i) square[i] = set.in[i] ? 0 : kFar;
    for (int axis = 0; axis < 3; ++axis) {
        for_each_cell(set.size, [&](const ivec3& at) {
            int least = kFar;
            for (int k = -std::min(reach, at[axis]);
                 k <= std::min(reach, set.size[axis] - 1 - at[axis]); ++k) {
                ivec3 other = at;
                other[axis] += k;
                least = std::min(least, square[set.index(other)] + k * k);
            }
            next[set.index(at)] = static_cast<std::uint16_t>(std::min<int>(least, kFar));
        });
        std::swap(square, next);
    }
    Cells grown(set.size);
    for (std::size_t i = 0; i < square.size(); ++i) grown.in[i] = square[i] < radius * radius;
    return grown;
}

/// The set and its copies that are moved by 1 to `cells` along z, up or down.
Cells swept(const Cells& set, int cells, int up) {
    Cells result(set.size);
    for (int y = 0; y < set.size.y; ++y)
        for (int x = 0; x < set.size.x; ++x) {
            int left = 0;  // cells that the last one of the set still covers
            for (int i = 0; i < set.size.z; ++i) {
                const std::size_t at = set.index({x, y, up > 0 ? i : set.size.z - 1 - i});
                if (set.in[at]) left = cells + 1;
                result.in[at] = left > 0;
                left = std::max(left - 1, 0);
            }
        }
    return result;
}

/// What is reached from the seeds over sides of cells that are not blocked.
Cells flooded(const Cells& blocked, const std::vector<ivec3>& seeds) {
    Cells reached(blocked.size);
    std::vector<ivec3> stack;
    const auto visit = [&](const ivec3& at) {
        if (!blocked.holds(at) || blocked.in[blocked.index(at)] || reached.in[blocked.index(at)])
            return;
        reached.in[blocked.index(at)] = 1;
        stack.push_back(at);
    };
    for (const ivec3& seed : seeds) visit(seed);
    while (!stack.empty()) {
        const ivec3 at = stack.back();
        stack.pop_back();
        for (int axis = 0; axis < 3; ++axis)
            for (const int step : {-1, 1}) {
                ivec3 other = at;
                other[axis] += step;
                visit(other);
            }
    }
    return reached;
}

/// A grid with one more cell on every side, so that surfaces close.
struct PaddedScene {
    Cells solid;
    std::vector<ivec3> cameras;
    double cell;
};

PaddedScene padded_scene(const VoxelGrid& grid, const std::vector<dvec3>& cameras,
                         const ColliderOptions& options) {
    const bool room = options.kind == ColliderKind::room;
    PaddedScene scene{Cells(grid.size + 2, room), {}, grid.cell};
    for_each_cell(grid.size, [&](const ivec3& at) {
        scene.solid.in[scene.solid.index(at + 1)] = grid.full[grid.index(at)] >= options.level;
    });
    for (const dvec3& camera : cameras) {
        const dvec3 at =
            glm::floor((glm::transpose(grid.axes) * camera - grid.low) / grid.cell) + 1.0;
        const dvec3 most(scene.solid.size);
        if (at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x < most.x && at.y < most.y && at.z < most.z)
            scene.cameras.emplace_back(at);
    }
    return scene;
}

/// What stays free: where a capsule comes from the cameras, and the cells around these.
Cells free_cells(const PaddedScene& scene, const ColliderOptions& options) {
    const double radius = std::max(options.radius / scene.cell, 0.5);
    const int below = static_cast<int>(
        std::lround(std::max(options.height - 2 * options.radius, 0.0) / scene.cell));
    const Cells blocked = swept(grown_by_ball(scene.solid, radius), below, 1);
    std::vector<ivec3> seeds;
    for (const ivec3& camera : scene.cameras)
        // Of a camera lower than an eye, the capsule starts as near above or below as it has room.
        for (int away = 0; away <= 2 * (below + static_cast<int>(radius) + 1); ++away) {
            const int step = away % 2 == 1 ? (away + 1) / 2 : -away / 2;
            const ivec3 at = camera + ivec3(0, 0, step);
            if (!blocked.holds(at) || blocked.in[blocked.index(at)]) continue;
            seeds.push_back(at);
            break;
        }
    Cells free = grown_by_ball(swept(flooded(blocked, seeds), below, -1), radius);
    for (const ivec3& camera : scene.cameras)
        for_each_cell(ivec3(3), [&](const ivec3& at) {
            const ivec3 beside = camera + at - 1;
            if (free.holds(beside)) free.in[free.index(beside)] = 1;
        });
    return free;
}

std::vector<ivec3> border_of(const ivec3& size) {
    std::vector<ivec3> border;
    for_each_cell(size, [&](const ivec3& at) {
        const ivec3 last = size - 1;
        if (at.x == 0 || at.y == 0 || at.z == 0 || at.x == last.x || at.y == last.y ||
            at.z == last.z)
            border.push_back(at);
    });
    return border;
}

/// Fills what the kind asks for.
Cells filled(const PaddedScene& scene, const ColliderOptions& options) {
    const Cells free = free_cells(scene, options);
    Cells solid = scene.solid;
    if (options.kind == ColliderKind::room)
        for (std::size_t i = 0; i < solid.in.size(); ++i) solid.in[i] = !free.in[i];
    if (options.kind == ColliderKind::ground) {
        solid = swept(solid, solid.size.z, -1);
        for (std::size_t i = 0; i < solid.in.size(); ++i)
            if (free.in[i]) solid.in[i] = 0;
        // The lowest layer is beyond the grid, and closes the ground from below.
        for (int y = 0; y < solid.size.y; ++y)
            for (int x = 0; x < solid.size.x; ++x) solid.in[solid.index({x, y, 0})] = 0;
    }
    if (options.kind == ColliderKind::object) {
        for (const ivec3& camera : scene.cameras) solid.in[solid.index(camera)] = 0;
        std::vector<ivec3> seeds = border_of(solid.size);
        seeds.insert(seeds.end(), scene.cameras.begin(), scene.cameras.end());
        const Cells outside = flooded(solid, seeds);
        for (std::size_t i = 0; i < solid.in.size(); ++i) solid.in[i] = !outside.in[i];
    }
    return solid;
}

// Marching tetrahedra: six around the diagonal of each cube of middles, so that neighbouring cubes
// cut their common side alike.

class SurfaceOfCells {
  public:
    SurfaceOfCells(const Cells& solid, const VoxelGrid& grid) : solid_(solid), grid_(grid) {}

    TriangleMesh make() {
        for_each_cell(solid_.size - 1, [&](const ivec3& at) {
            const std::uint8_t first = solid_.in[solid_.index(at)];
            bool mixed = false;
            for (int k = 1; k < 8; ++k) mixed |= solid_.in[solid_.index(at + corner(k))] != first;
            if (mixed)
                for (const auto& order : kOrders) add_tetrahedron(at, order);
        });
        return std::move(mesh_);
    }

  private:
    // The axes in the order in which the tetrahedron's edges walk from corner 0 to corner 7.
    static constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                          {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    static ivec3 corner(int bits) { return {bits & 1, bits >> 1 & 1, bits >> 2 & 1}; }

    void add_tetrahedron(const ivec3& at, const int (&order)[3]) {
        int bits[4] = {0, 1 << order[0], (1 << order[0]) | (1 << order[1]), 7};
        std::vector<int> in, out;
        for (const int b : bits) (solid_.in[solid_.index(at + corner(b))] ? in : out).push_back(b);
        if (in.empty() || out.empty()) return;
        const auto cut = [&](int a, int b) { return vertex(at, std::min(a, b), std::max(a, b)); };
        dvec3 outwards(0.0);
        for (const int b : out) outwards += dvec3(corner(b)) / double(out.size());
        for (const int b : in) outwards -= dvec3(corner(b)) / double(in.size());
        outwards = grid_.axes * outwards;
        if (in.size() == 2) {  // a quad, around
            add_face(cut(in[0], out[0]), cut(in[0], out[1]), cut(in[1], out[1]), outwards);
            add_face(cut(in[0], out[0]), cut(in[1], out[1]), cut(in[1], out[0]), outwards);
        } else if (in.size() == 1) {
            add_face(cut(in[0], out[0]), cut(in[0], out[1]), cut(in[0], out[2]), outwards);
        } else {
            add_face(cut(in[0], out[0]), cut(in[1], out[0]), cut(in[2], out[0]), outwards);
        }
    }

    void add_face(std::uint32_t a, std::uint32_t b, std::uint32_t c, const dvec3& outwards) {
        const dvec3 p(mesh_.position[a]);
        const dvec3 normal = glm::cross(dvec3(mesh_.position[b]) - p, dvec3(mesh_.position[c]) - p);
        if (glm::dot(normal, outwards) < 0) std::swap(b, c);
        mesh_.face.push_back({a, b, c});
    }

    /// In the middle between the corners `from` and `to` of the cube at `at`; every bit of `from`
    /// is one of `to`, so that an edge has one name.
    std::uint32_t vertex(const ivec3& at, int from, int to) {
        const std::size_t name =
            8 * solid_.index(at + corner(from)) + static_cast<std::size_t>(to & ~from);
        const auto [place, added] =
            number_.try_emplace(name, static_cast<std::uint32_t>(mesh_.vertex_count()));
        if (added) {
            const dvec3 middle = dvec3(at) + (dvec3(corner(from)) + dvec3(corner(to))) / 2.0;
            // The grid without its padding begins one cell on.
            mesh_.position.emplace_back(grid_.axes * (grid_.low + grid_.cell * (middle - 0.5)));
        }
        return place->second;
    }

    const Cells& solid_;
    const VoxelGrid& grid_;
    TriangleMesh mesh_;
    std::unordered_map<std::size_t, std::uint32_t> number_;
};

/// How often the mesh winds around the point. Source: van Oosterom and Strackee 1983.
double winding_number(const TriangleMesh& mesh, const dvec3& point) {
    double sum = 0;
    for (const auto& face : mesh.face) {
        const dvec3 a = dvec3(mesh.position[face[0]]) - point,
                    b = dvec3(mesh.position[face[1]]) - point,
                    c = dvec3(mesh.position[face[2]]) - point;
        const double x = glm::length(a), y = glm::length(b), z = glm::length(c);
        sum += std::atan2(glm::dot(a, glm::cross(b, c)),
                          x * y * z + glm::dot(a, b) * z + glm::dot(b, c) * x + glm::dot(c, a) * y);
    }
    return sum / (2 * std::numbers::pi);
}

}  // namespace

glm::dmat3 upright_axes(const dvec3& up) {
    const dvec3 z = glm::normalize(up);
    dvec3 aside(1, 0, 0);
    if (std::abs(z.x) > std::abs(z.y)) aside = {0, 1, 0};
    const dvec3 y = glm::normalize(glm::cross(z, aside));
    return {glm::cross(y, z), y, z};
}

VoxelGrid make_grid(const glm::dmat3& axes, const dvec3& low, const dvec3& high, double cell) {
    DARB_CHECK(cell > 0, "{}", cell);
    const dvec3 count = glm::max(glm::ceil((high - low) / cell - 1e-9), dvec3(1.0));
    if (const double cells = count.x * count.y * count.z; !(cells <= kMostCells))
        throw Error(
            "collider",
            fmt::format("the grid would have {:.3g} cells of {:.3g}, and may have {:.3g}", cells,
                        cell, kMostCells),
            fmt::format("Take cells of at least {:.3g} (--voxel), or a smaller box (--bounds).",
                        1.01 * cell * std::cbrt(cells / kMostCells)));
    VoxelGrid grid{axes, low, cell, ivec3(count), {}};
    grid.full.assign(std::size_t(count.x) * std::size_t(count.y) * std::size_t(count.z), 0.0f);
    return grid;
}

void fill_grid(const std::function<double(const dvec3& point)>& density, VoxelGrid& grid) {
    in_pieces(std::size_t(grid.size.z), 1, [&](std::size_t first, std::size_t count) {
        for (int z = int(first); z < int(first + count); ++z)
            for (int y = 0; y < grid.size.y; ++y)
                for (int x = 0; x < grid.size.x; ++x)
                    grid.full[grid.index({x, y, z})] =
                        static_cast<float>(density(grid.middle({x, y, z})));
    });
}

void fill_grid(const SplatModel& splats, VoxelGrid& grid) {
    std::fill(grid.full.begin(), grid.full.end(), 1.0f);  // how open it is
    for (std::size_t i = 0; i < splats.size(); ++i) add_splat(splats, i, grid);
    for (float& full : grid.full) full = 1 - full;
}

std::optional<ColliderKind> collider_kind_from_name(std::string_view name) {
    if (name == "room") return ColliderKind::room;
    if (name == "ground") return ColliderKind::ground;
    if (name == "object") return ColliderKind::object;
    return std::nullopt;
}

TriangleMesh make_collider(const VoxelGrid& grid, const std::vector<dvec3>& cameras,
                           const ColliderOptions& options) {
    const PaddedScene scene = padded_scene(grid, cameras, options);
    if (options.kind == ColliderKind::room && scene.cameras.empty())
        throw Error("collider", "a room needs a place within it to begin from",
                    "Name cameras that stand in the room (--cameras), or ask for an object.");
    const TriangleMesh raw = SurfaceOfCells(filled(scene, options), grid).make();
    TriangleMesh full = raw;
    // Specks of one or two cells go; the surroundings of a camera are three wide.
    clean_mesh(full, {.min_extent = 2.5 * grid.cell});
    if (full.face_count() == 0)
        throw Error(
            "collider",
            fmt::format("there is no surface: no cell of {:.3g} is solid from {} on, or all "
                        "are",
                        grid.cell, options.level),
            "Take smaller cells (--voxel), or another box (--bounds).");
    for (std::size_t faces = options.faces;; faces *= 2) {
        const TriangleMesh mesh = simplify_mesh(full, faces).mesh;
        const bool clear = std::none_of(cameras.begin(), cameras.end(), [&](const dvec3& camera) {
            return is_in_solid(mesh, options.kind, camera) &&
                   !is_in_solid(full, options.kind, camera);
        });
        if (mesh.face_count() > 0 && (clear || faces >= full.face_count())) return mesh;
    }
}

bool is_in_solid(const TriangleMesh& collider, ColliderKind kind, const dvec3& point) {
    // Around a room the solid has no end, and the surface winds around what is free, backwards.
    return winding_number(collider, point) > (kind == ColliderKind::room ? -0.5 : 0.5);
}

}  // namespace darb
