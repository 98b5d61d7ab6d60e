// SPDX-License-Identifier: MIT
// Surfaces out of splats that are laid on known ones: closed meshes of the right genus, as near as
// a quarter of a voxel, for every kernel of the list; and what is thin, by the opacity field.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "engine/core/rng.h"
#include "engine/mesh/clean.h"
#include "engine/mesh/opacity.h"
#include "engine/mesh/tsdf.h"
#include "tests/support/every_kernel.h"
#include "tests/support/shared_device.h"

namespace darb::test {
namespace {

enum class Solid { ball, box, ring, plate };
constexpr double kBallRadius = 1, kHalfSide = 0.7, kRingRadius = 0.8, kTubeRadius = 0.35;
constexpr double kPlateHalf = 0.06;  // of its thickness
constexpr const char* kSolidNames[] = {"ball", "box", "ring", "plate"};

glm::dvec3 half_sides(Solid solid) {
    return {kHalfSide, solid == Solid::plate ? kPlateHalf : kHalfSide, kHalfSide};
}

double signed_distance(Solid solid, const glm::dvec3& p) {
    if (solid == Solid::ball) return glm::length(p) - kBallRadius;
    if (solid == Solid::ring)
        return glm::length(glm::dvec2(glm::length(glm::dvec2(p.x, p.z)) - kRingRadius, p.y)) -
               kTubeRadius;
    const glm::dvec3 over = glm::abs(p) - half_sides(solid);
    return glm::length(glm::max(over, 0.0)) + std::min(std::max({over.x, over.y, over.z}), 0.0);
}

struct SurfacePoint {
    glm::dvec3 place, normal;
};

std::vector<SurfacePoint> points_on(Solid solid, double spacing) {
    std::vector<SurfacePoint> points;
    const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
    if (solid == Solid::ball) {
        const int n = static_cast<int>(4 * std::numbers::pi / (spacing * spacing));
        for (int i = 0; i < n; ++i) {
            const double y = 1 - (2.0 * i + 1) / n, r = std::sqrt(1 - y * y);
            const glm::dvec3 d(r * std::cos(golden * i), y, r * std::sin(golden * i));
            points.push_back({kBallRadius * d, d});
        }
    } else if (solid == Solid::box || solid == Solid::plate) {
        const glm::dvec3 half = half_sides(solid);
        for (int axis = 0; axis < 3; ++axis)
            for (const double side : {-1.0, 1.0}) {
                const int b = (axis + 1) % 3, c = (axis + 2) % 3;
                const int n = std::max(static_cast<int>(2 * half[b] / spacing), 1);
                const int m = std::max(static_cast<int>(2 * half[c] / spacing), 1);
                for (int i = 0; i < n * m; ++i) {
                    glm::dvec3 p, normal(0.0);
                    p[axis] = side * half[axis];
                    p[b] = half[b] * ((2.0 * (i % n) + 1) / n - 1);
                    p[c] = half[c] * ((2.0 * (i / n) + 1) / m - 1);
                    normal[axis] = side;
                    points.push_back({p, normal});
                }
            }
    } else {
        const int around = static_cast<int>(2 * std::numbers::pi * kRingRadius / spacing);
        for (int i = 0; i < around; ++i) {
            const double a = 2 * std::numbers::pi * i / around;
            const glm::dvec3 out(std::cos(a), 0, std::sin(a));
            const int along = static_cast<int>(2 * std::numbers::pi * kTubeRadius / spacing);
            for (int j = 0; j < along; ++j) {
                const double b = 2 * std::numbers::pi * (j + 0.5 * (i % 2)) / along;
                const glm::dvec3 n = std::cos(b) * out + std::sin(b) * glm::dvec3(0, 1, 0);
                points.push_back({kRingRadius * out + kTubeRadius * n, n});
            }
        }
    }
    return points;
}

// w x y z of the turn that brings z to the normal.
glm::dvec4 turn_to(const glm::dvec3& n) {
    const glm::dvec3 axis(-n.y, n.x, 0);
    const double w = 1 + n.z;
    const glm::dvec4 q = w > 1e-6 ? glm::dvec4(w, axis) : glm::dvec4(0, 1, 0, 0);
    return q / glm::length(q);
}

SplatModel splats_on(Solid solid, int kernel, double spacing) {
    const std::vector<SurfacePoint> points = points_on(solid, spacing);
    SplatModel model;
    model.kernel = kernel;
    model.resize(points.size());
    const double width = solid == Solid::box ? 0.8 : 0.65;  // wider, so that no edge is open
    const double wide = std::log(width * spacing), flat = std::log(0.02 * spacing);
    for (size_t i = 0; i < points.size(); ++i) {
        const glm::dvec4 q = turn_to(points[i].normal);
        for (int c = 0; c < 3; ++c) {
            model.position[3 * i + c] = static_cast<float>(points[i].place[c]);
            model.log_scale[3 * i + c] = static_cast<float>(c == 2 ? flat : wide);
            model.sh_dc[3 * i + c] = static_cast<float>(points[i].normal[c]);
        }
        for (int c = 0; c < 4; ++c) model.rotation[4 * i + c] = static_cast<float>(q[c]);
        model.opacity_logit[i] = 5;
    }
    return model;
}

std::vector<Camera> cameras_around(int count, double distance, int size) {
    std::vector<Camera> cameras;
    const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
    for (int i = 0; i < count; ++i) {
        const double y = 1 - (2.0 * i + 1) / count, r = std::sqrt(1 - y * y);
        const glm::dvec3 from =
            distance * glm::dvec3(r * std::cos(golden * i), y, r * std::sin(golden * i));
        const glm::dvec3 forward = -glm::normalize(from);
        const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0.1, 1, 0.05), forward));
        const glm::dvec3 down = glm::cross(forward, right);
        Camera c;
        c.width = c.height = size;
        c.fx = c.fy = 1.1 * size;
        c.cx = c.cy = 0.5 * size;
        c.rotation = glm::transpose(glm::dmat3(right, down, forward));
        c.translation = -(c.rotation * from);
        cameras.push_back(c);
    }
    return cameras;
}

constexpr int kViews = 40, kSize = 160;
constexpr double kDistance = 3.4, kSpacing = 0.06, kVoxel = 0.1;

std::vector<DepthView> views_of(const SplatModel& model, bool colours = false) {
    Renderer renderer(shared_device(), model);
    auto views = render_depth_views(renderer, cameras_around(kViews, kDistance, kSize),
                                    {.colours = colours});
    keep_confirmed(shared_device(), views, model.origin);
    return views;
}

/// Faces by directed edge; closed where each has its opposite and none is there twice.
bool is_closed(const TriangleMesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& f : mesh.face)
        for (int k = 0; k < 3; ++k) ++edges[{f[k], f[(k + 1) % 3]}];
    for (const auto& [edge, count] : edges) {
        const auto back = edges.find({edge.second, edge.first});
        if (count != 1 || back == edges.end()) return false;
    }
    return !mesh.face.empty();
}

/// V - E + F of a closed mesh: 2 for a ball, 0 for a ring, of one part.
long euler_number(const TriangleMesh& mesh) {
    const long faces = long(mesh.face_count());
    return long(mesh.vertex_count()) - 3 * faces / 2 + faces;
}

class SurfaceOf : public testing::TestWithParam<std::tuple<int, Solid>> {};

TEST_P(SurfaceOf, splats_is_closed_and_near_the_truth) {
    const auto [kernel, solid] = GetParam();
    const SplatModel model = splats_on(solid, kernel, kSpacing);
    const auto views = views_of(model);
    TsdfReport report;
    TriangleMesh mesh = fuse_depths(shared_device(), views, model.origin,
                                    {.voxel = kVoxel, .truncation = 3}, report);
    // At a corner of the box two views may not agree: a hole is closed there, as --fill-holes does.
    clean_mesh(mesh, {.keep = 1, .longest_rim = solid == Solid::box ? 12 * kVoxel : 0});
    EXPECT_TRUE(is_closed(mesh));
    EXPECT_EQ(euler_number(mesh), solid == Solid::ring ? 0 : 2);
    std::vector<double> errors;
    size_t outward = 0;
    for (size_t v = 0; v < mesh.vertex_count(); ++v) {
        const glm::dvec3 p(mesh.position[v]), n(mesh.normal[v]);
        errors.push_back(std::abs(signed_distance(solid, p)));
        outward += signed_distance(solid, p + 0.05 * n) > signed_distance(solid, p) ? 1 : 0;
    }
    std::ranges::sort(errors);
    // These two end with a jump far from the middle, and a slice begins there: measured, and a
    // margin.
    const bool jumps = kernel == KERNEL_INVERSE_QUADRATIC || kernel == KERNEL_INVERSE_MULTIQUADRIC;
    EXPECT_LE(quantile(errors, 0.5), kVoxel * (jumps ? 0.6 : 0.28));
    EXPECT_LE(quantile(errors, 0.99), kVoxel * (jumps ? 1.4 : 1.0));
    EXPECT_GE(outward, mesh.vertex_count() * 99 / 100);
    if (testing::Test::HasFailure())
        printf("%s %s: %zu vertices, median %.4f, 99 %% %.4f voxels\n",
               std::string(kernel_name(kernel)).c_str(), kSolidNames[int(solid)],
               mesh.vertex_count(), quantile(errors, 0.5) / kVoxel,
               quantile(errors, 0.99) / kVoxel);
}

/// The Gaussian on all three, and each other kernel on one of them.
std::vector<std::tuple<int, Solid>> kernels_and_solids() {
    std::vector<std::tuple<int, Solid>> cases;
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
        for (const Solid solid : {Solid::ball, Solid::box, Solid::ring})
            if (kernel == KERNEL_GAUSSIAN || kernel % 3 == int(solid))
                cases.emplace_back(kernel, solid);
    return cases;
}

INSTANTIATE_TEST_SUITE_P(Kernels, SurfaceOf, testing::ValuesIn(kernels_and_solids()),
                         [](const auto& given) {
                             return std::string(kernel_name(std::get<0>(given.param))) + "_" +
                                    kSolidNames[int(std::get<1>(given.param))];
                         });

TEST(Surface, has_the_same_bits_in_ranges_and_again) {
    const SplatModel model = splats_on(Solid::ring, KERNEL_GAUSSIAN, kSpacing);
    const auto views = views_of(model);
    TsdfReport whole, parts, again;
    const TriangleMesh a = fuse_depths(shared_device(), views, model.origin,
                                       {.voxel = kVoxel, .truncation = 3}, whole);
    const TriangleMesh b =
        fuse_depths(shared_device(), views, model.origin,
                    {.voxel = kVoxel, .truncation = 3, .working_bytes = 1 << 19}, parts);
    const TriangleMesh c = fuse_depths(shared_device(), views, model.origin,
                                       {.voxel = kVoxel, .truncation = 3}, again);
    EXPECT_EQ(whole.ranges, 1u);
    EXPECT_GT(parts.ranges, 2u);
    for (const TriangleMesh* other : {&b, &c}) {
        EXPECT_EQ(a.position, other->position);
        EXPECT_EQ(a.face, other->face);
    }
}

TriangleMesh level_surface(const SplatModel& model, const std::vector<DepthView>& views,
                           std::uint64_t working_bytes = 64 << 20) {
    Renderer renderer(shared_device(), model);
    OpacityField field(renderer, views, model.origin, {}, working_bytes / 4);
    TsdfReport report;
    return opacity_surface(shared_device(), field, views, model.origin,
                           {.voxel = kVoxel, .truncation = 3, .working_bytes = working_bytes},
                           report);
}

/// Share of a solid's points that the mesh has a vertex within a voxel of, and the quantiles of how
/// far vertices are from the solid, voxels.
struct Fit {
    double recall, median, most;
};

Fit fit_of(const TriangleMesh& mesh, Solid solid) {
    const auto points = points_on(solid, kSpacing);
    double found = 0;
    for (const SurfacePoint& point : points) {
        const auto is_near = [&](const glm::vec3& p) {
            return glm::distance(glm::dvec3(p), point.place) < kVoxel &&
                   std::abs(signed_distance(solid, glm::dvec3(p))) < kVoxel / 4;
        };
        found += std::ranges::any_of(mesh.position, is_near) ? 1 : 0;
    }
    std::vector<double> errors;
    for (const glm::vec3& p : mesh.position)
        errors.push_back(std::abs(signed_distance(solid, glm::dvec3(p))) / kVoxel);
    std::ranges::sort(errors);
    return {found / double(points.size()), quantile(errors, 0.5), quantile(errors, 0.99)};
}

TEST(OpacitySurface, of_a_ball_is_closed_and_near_the_truth) {
    const SplatModel model = splats_on(Solid::ball, KERNEL_GAUSSIAN, kSpacing);
    const auto views = views_of(model);
    TriangleMesh mesh = level_surface(model, views);
    const TriangleMesh raw = mesh;
    clean_mesh(mesh, {.keep = 1});
    EXPECT_TRUE(is_closed(mesh));
    EXPECT_EQ(euler_number(mesh), 2);
    const Fit fit = fit_of(mesh, Solid::ball);
    printf("ball by opacity: median %.3f, 99 %% %.3f voxels\n", fit.median, fit.most);
    EXPECT_EQ(fit.recall, 1);
    EXPECT_LE(fit.median, 0.25);
    EXPECT_LE(fit.most, 1);
    const TriangleMesh parts = level_surface(model, views, 1 << 19);
    EXPECT_EQ(raw.position, parts.position);
    EXPECT_EQ(raw.face, parts.face);
}

TEST(OpacitySurface, keeps_a_plate_that_distances_lose) {
    const SplatModel model = splats_on(Solid::plate, KERNEL_GAUSSIAN, kSpacing);
    const auto views = views_of(model);
    TsdfReport report;
    const TriangleMesh fused = fuse_depths(shared_device(), views, model.origin,
                                           {.voxel = kVoxel, .truncation = 3}, report);
    const TriangleMesh kept = level_surface(model, views);
    const Fit lost = fit_of(fused, Solid::plate), fit = fit_of(kept, Solid::plate);
    for (const Fit& f : {lost, fit})
        printf("plate: recall %.3f, median %.3f, 99 %% %.3f voxels\n", f.recall, f.median, f.most);
    EXPECT_LT(lost.recall, 0.7);
    EXPECT_GT(fit.recall, 0.95);
    EXPECT_LE(fit.median, 0.25);
    EXPECT_LE(fit.most, 1);
}

TEST(Surface, colours_are_those_of_the_splats) {
    const SplatModel model = splats_on(Solid::ball, KERNEL_GAUSSIAN, kSpacing);
    const auto views = views_of(model, true);
    TsdfReport report;
    TriangleMesh mesh = fuse_depths(shared_device(), views, model.origin,
                                    {.voxel = kVoxel, .truncation = 3}, report);
    bake_colours(shared_device(), views, mesh, report.voxel, 64 << 20);
    ASSERT_EQ(mesh.colour.size(), mesh.vertex_count());
    std::vector<double> errors;
    for (size_t v = 0; v < mesh.vertex_count(); ++v)
        for (int c = 0; c < 3; ++c) {
            const double n = glm::normalize(glm::dvec3(mesh.position[v]))[c];
            errors.push_back(std::abs(mesh.colour[v][c] - 255 * (0.5 + SH_C0 * n)));
        }
    std::ranges::sort(errors);
    EXPECT_LE(quantile(errors, 0.5), 5);  // of 255: a picture mixes neighbours
    EXPECT_LE(quantile(errors, 0.95), 12);
    const auto first = mesh.colour;
    bake_colours(shared_device(), views, mesh, report.voxel, 1 << 18);
    EXPECT_EQ(mesh.colour, first) << "in parts";
}

TEST(Surface, is_cut_to_its_bounds) {
    const SplatModel model = splats_on(Solid::ball, KERNEL_GAUSSIAN, kSpacing);
    const auto views = views_of(model);
    const WorldBox box{glm::dvec3(-2, -0.3, -2), glm::dvec3(2, 2, 2)};
    TsdfReport report;
    const TriangleMesh mesh =
        fuse_depths(shared_device(), views, model.origin, {.voxel = kVoxel, .bounds = box}, report);
    EXPECT_FALSE(is_closed(mesh));
    for (const auto& face : mesh.face)
        for (const std::uint32_t v : face) ASSERT_GE(mesh.position[v].y, -0.3f);
    EXPECT_GT(mesh.face_count(), 1000u);
}

TEST(Surface, of_nothing_is_an_error) {
    SplatModel model = splats_on(Solid::ball, KERNEL_GAUSSIAN, 0.2);
    for (float& logit : model.opacity_logit) logit = -4;
    const auto views = views_of(model);
    TsdfReport report;
    EXPECT_THROW(fuse_depths(shared_device(), views, model.origin, {}, report), Error);
}

TEST(ConfirmedDepths, leave_out_what_one_view_alone_shows) {
    const SplatModel model = splats_on(Solid::ball, KERNEL_GAUSSIAN, kSpacing);
    Renderer renderer(shared_device(), model);
    auto views = render_depth_views(renderer, cameras_around(kViews, kDistance, kSize), {});
    const Camera& c = views[0].camera;
    const size_t middle = size_t(c.height / 2) * c.width + c.width / 2;
    views[0].depth[middle] = 1.5f;  // a veil halfway to the ball
    const ConfirmedDepths counts = keep_confirmed(shared_device(), views, model.origin);
    EXPECT_EQ(views[0].depth[middle], 0);
    EXPECT_GT(views[0].depth[middle + 1], 0);
    EXPECT_GT(counts.kept, counts.surfaces * 8 / 10);
    EXPECT_LT(counts.kept, counts.surfaces);
}

}  // namespace
}  // namespace darb::test
