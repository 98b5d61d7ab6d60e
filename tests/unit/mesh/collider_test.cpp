// SPDX-License-Identifier: MIT
// Colliders of a room, a hill and an object: closed, manifold, free where the cameras are, and
// solid where a body would stand.
#include "engine/mesh/collider.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/kernels/kernel_family.h"
#include "engine/mesh/clean.h"
#include "engine/mesh/surface_search.h"
#include "engine/mesh/topology.h"

namespace darb::test {
namespace {

using glm::dvec3;

void expect_closed_and_clear(const TriangleMesh& mesh, const std::vector<dvec3>& cameras,
                             const ColliderOptions& options) {
    const Topology t = topology_of(mesh);
    EXPECT_TRUE(t.is_closed()) << t.rim_edges << " edges of rims";
    EXPECT_TRUE(t.is_manifold()) << t.crowded_edges << " crowded, " << t.turned_edges << " turned, "
                                 << t.pinched_vertices << " pinched";
    EXPECT_LE(mesh.face_count(), options.faces);
    for (const dvec3& camera : cameras)
        EXPECT_FALSE(is_in_solid(mesh, options.kind, camera))
            << camera.x << " " << camera.y << " " << camera.z;
}

/// How far a point can fall before a face is within `radius` of it.
double falls(const SurfaceSearch& search, dvec3 at, double radius, double most) {
    for (double fallen = 0; fallen < most;) {
        const double gap = search.nearest(at).distance - radius;
        if (gap < 1e-4) return fallen;
        at.z -= gap;
        fallen += gap;
    }
    return most;
}

/// A room of 4 x 3 x 2.5 with walls of 0.1, a table in it, and a slit too narrow for anybody.
double room(const dvec3& p) {
    const dvec3 outside = glm::abs(p - dvec3(2, 1.5, 1.25)) - dvec3(2, 1.5, 1.25);
    const double out = std::max({outside.x, outside.y, outside.z});
    if (out > 0) return out < 0.1 && !(p.y > 3 && std::abs(p.x - 1) < 0.08) ? 0.9 : 0;
    return p.x > 2.6 && p.x < 3.4 && p.y > 1 && p.y < 2 && p.z < 0.8 ? 0.5 : 0;
}

TEST(Collider, room_is_closed_and_walked_in) {
    VoxelGrid grid = make_grid(glm::dmat3(1), dvec3(-0.3), dvec3(4.3, 3.3, 2.8), 0.05);
    fill_grid(room, grid);
    const std::vector<dvec3> cameras = {{0.6, 0.6, 1.6}, {1.5, 2.2, 1.7}, {0.5, 2.5, 0.3}};
    if (!can_simplify()) GTEST_SKIP() << "built without meshoptimizer";
    const ColliderOptions options;
    const TriangleMesh mesh = make_collider(grid, cameras, options);
    expect_closed_and_clear(mesh, cameras, options);
    EXPECT_EQ(topology_of(mesh).parts, 1u) << "the table stands on the floor";
    EXPECT_TRUE(is_in_solid(mesh, options.kind, {3, 1.5, 0.4})) << "in the table";
    EXPECT_TRUE(is_in_solid(mesh, options.kind, {1, 3.2, 1.2})) << "the slit is no way out";
    EXPECT_TRUE(is_in_solid(mesh, options.kind, {9, 9, 9}));
    // A body of the capsule's radius stands on the floor wherever it walks.
    const SurfaceSearch search(mesh);
    for (double x = 0.4; x < 2.2; x += 0.3)
        for (double y = 0.4; y < 2.7; y += 0.3)
            EXPECT_NEAR(falls(search, {x, y, 1}, options.radius, 10), 1 - options.radius, 0.1)
                << x << " " << y;
    EXPECT_NEAR(falls(search, {3, 1.5, 1.5}, options.radius, 10), 1.5 - 0.8 - options.radius, 0.1)
        << "onto the table";
    // The walls are where they are, within two cells.
    for (const double z : {0.5, 1.2, 2.0}) {
        EXPECT_LT(search.nearest({0, 1.5, z}).distance, 0.1);
        EXPECT_LT(search.nearest({1.5, 0, z}).distance, 0.1);
    }
    EXPECT_THROW(make_collider(grid, {}, options), Error);
}

TEST(Collider, ground_is_filled_below_and_free_where_one_walks) {
    // A thin shell of a hill, and a roof on it under which one can walk; up is not an axis.
    const dvec3 up = glm::normalize(dvec3(0.3, -1, 0.2));
    const glm::dmat3 axes = upright_axes(up);
    EXPECT_NEAR(glm::determinant(axes), 1, 1e-12);
    EXPECT_NEAR(glm::dot(axes[2], up), 1, 1e-12);
    const auto height = [](double x, double y) { return 0.5 * std::exp(-(x * x + y * y) / 4); };
    VoxelGrid grid = make_grid(axes, dvec3(-4, -4, -0.5), dvec3(4, 4, 4), 0.1);
    fill_grid(
        [&](const dvec3& world) {
            const dvec3 p = glm::transpose(axes) * world;
            const bool roof = std::abs(p.z - 3) < 0.1 && p.x > 1 && std::abs(p.y) < 1;
            return roof || std::abs(p.z - height(p.x, p.y)) < 0.12 ? 1.0 : 0.0;
        },
        grid);
    const std::vector<dvec3> cameras = {axes * dvec3(-2, 0, 2.2), axes * dvec3(2, 0, 1.9)};
    ColliderOptions options;
    options.kind = ColliderKind::ground;
    options.radius = 0.3;
    if (!can_simplify()) GTEST_SKIP() << "built without meshoptimizer";
    const TriangleMesh mesh = make_collider(grid, cameras, options);
    expect_closed_and_clear(mesh, cameras, options);
    EXPECT_TRUE(is_in_solid(mesh, options.kind, axes * dvec3(-1, 1, -0.3))) << "below the shell";
    EXPECT_FALSE(is_in_solid(mesh, options.kind, axes * dvec3(2.5, 0.5, 1.5))) << "under the roof";
    EXPECT_TRUE(is_in_solid(mesh, options.kind, axes * dvec3(2.5, 0.5, 3))) << "the roof";
    const SurfaceSearch search(mesh);
    std::size_t near = 0, all = 0;
    for (double x = -3; x <= 3; x += 0.25)
        for (double y = -3; y <= 3; y += 0.25, ++all)
            near += search.nearest(axes * dvec3(x, y, height(x, y))).distance < 0.2;
    EXPECT_GE(double(near), 0.95 * double(all)) << "within two cells";
}

TEST(Collider, object_of_splats_has_no_hollow) {
    // Splats on a sphere leave its inside empty.
    SplatModel model;
    model.kernel = KERNEL_RAISED_COSINE;
    constexpr std::size_t kSplats = 2000;
    model.resize(kSplats);
    for (std::size_t i = 0; i < kSplats; ++i) {
        const double z = 1 - 2 * (double(i) + 0.5) / kSplats, a = 2.399963229728653 * double(i);
        const dvec3 p(std::sqrt(1 - z * z) * std::cos(a), std::sqrt(1 - z * z) * std::sin(a), z);
        for (int c = 0; c < 3; ++c) model.position[3 * i + std::size_t(c)] = float(p[c]);
        for (std::size_t c = 0; c < 3; ++c) model.log_scale[3 * i + c] = std::log(0.06f);
        model.rotation[4 * i] = 1;
        model.opacity_logit[i] = 3;
    }
    VoxelGrid grid = make_grid(glm::dmat3(1), dvec3(-1.3), dvec3(1.3), 0.05);
    fill_grid(model, grid);
    const auto full = [&](const dvec3& p) {
        return grid.full[grid.index(glm::ivec3(glm::floor((p - grid.low) / grid.cell)))];
    };
    EXPECT_LT(full({0, 0, 0}), 1e-6);
    EXPECT_GT(full({1, 0, 0}), 0.5);
    ColliderOptions options;
    options.kind = ColliderKind::object;
    const std::vector<dvec3> cameras = {{2, 0, 0}, {1.25, 0, 0}};
    if (!can_simplify()) GTEST_SKIP() << "built without meshoptimizer";
    const TriangleMesh mesh = make_collider(grid, cameras, options);
    expect_closed_and_clear(mesh, cameras, options);
    EXPECT_EQ(topology_of(mesh).parts, 1u);
    EXPECT_EQ(topology_of(mesh).genus(), 0);
    EXPECT_TRUE(is_in_solid(mesh, options.kind, dvec3(0.1)));
    for (const glm::vec3& p : mesh.position) EXPECT_NEAR(glm::length(p), 1.1, 0.1);
    options.level = 1.1;
    EXPECT_THROW(make_collider(grid, cameras, options), Error);
}

TEST(Collider, splats_fill_cells_as_the_product_says) {
    SplatModel model;
    model.resize(2);
    for (std::size_t i = 0; i < 2; ++i) {
        model.position[3 * i] = i == 0 ? 0.0f : 0.3f;
        for (std::size_t c = 0; c < 3; ++c)
            model.log_scale[3 * i + c] = std::log(c == 0 ? 0.4f : 0.2f);
        model.rotation[4 * i] = model.rotation[4 * i + 3] = std::sqrt(0.5f);  // x to y
        model.opacity_logit[i] = i == 0 ? 0.0f : -1.0f;
    }
    for (const int kernel : {KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE}) {
        model.kernel = kernel;
        const double scale = covariance_scale(kernel, model.footprint);
        VoxelGrid grid = make_grid(glm::dmat3(1), dvec3(-1), dvec3(1.3, 1, 1), 0.1);
        fill_grid(model, grid);
        for (int y = 0; y < grid.size.y; y += 3)
            for (int x = 0; x < grid.size.x; x += 2) {
                const dvec3 p = grid.middle({x, y, 10});
                double open = 1;
                for (std::size_t i = 0; i < 2; ++i) {
                    const dvec3 local = (p - dvec3(model.position[3 * i], 0, 0)) /
                                        (dvec3(0.2, 0.4, 0.2) * std::sqrt(scale));
                    open *= 1 - sigmoid(model.opacity_logit[i]) *
                                    kernel_value(kernel, Footprint::psi, glm::dot(local, local));
                }
                // Two splats of which each may drop 1/255, and a centre that is taken as met.
                EXPECT_NEAR(grid.full[grid.index({x, y, 10})], 1 - open, 0.05)
                    << kernel << " at " << x << " " << y;
            }
    }
    EXPECT_THROW(make_grid(glm::dmat3(1), dvec3(0), dvec3(1), 1e-4), Error);
}

}  // namespace
}  // namespace darb::test
