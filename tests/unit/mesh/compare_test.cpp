// SPDX-License-Identifier: MIT
// Distances between meshes, points and exact shapes whose answers are known.
#include "engine/mesh/compare.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "tests/support/mesh_shapes.h"

namespace darb::test {
namespace {

std::string refusal(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

TEST(SampleSurface, is_even_by_area_and_repeats) {
    // Half of the square in two faces, the other half in 200.
    TriangleMesh mesh = square_mesh(1, 1);
    TriangleMesh fine = square_mesh(1, 10);
    for (glm::vec3& p : fine.position) p.x += 1;
    append_mesh(fine, mesh);
    double spacing = 0.01;
    const SurfaceSamples samples = sample_surface(mesh, spacing);
    EXPECT_EQ(spacing, 0.01);
    EXPECT_NEAR(double(samples.position.size()), 20000, 1);
    const auto left = std::count_if(samples.position.begin(), samples.position.end(),
                                    [](const glm::dvec3& p) { return p.x < 1; });
    EXPECT_NEAR(double(left), 10000, 2) << "one in each equal piece";
    double x = 0;
    for (const glm::dvec3& p : samples.position) x += p.x / double(samples.position.size());
    EXPECT_NEAR(x, 1, 0.01);
    EXPECT_EQ(sample_surface(mesh, spacing).position, samples.position);
    double tiny = 1e-6;
    EXPECT_LE(sample_surface(mesh, tiny).position.size(), 2000001u);
    EXPECT_GT(tiny, 1e-4);
}

TEST(CompareMeshes, parallel_squares_are_their_distance_apart) {
    const TriangleMesh mesh = square_mesh(4, 4);
    TriangleMesh reference = square_mesh(4, 7);
    reference.origin = {0, 0, 0.25};
    CompareOptions options;
    options.spacing = 0.05;
    options.thresholds = {0.2, 0.3};
    const MeshComparison c = compare_meshes(mesh, reference, options, "reference");
    for (const DistanceStatistics& d : {c.accuracy, c.completeness}) {
        EXPECT_NEAR(d.mean, 0.25, 1e-6);
        EXPECT_NEAR(d.median, 0.25, 1e-6);
        EXPECT_NEAR(d.p90, 0.25, 1e-6);
        EXPECT_NEAR(d.largest, 0.25, 1e-6);
        EXPECT_NEAR(double(d.samples), 6400, 1);
    }
    EXPECT_NEAR(c.bias, -0.25, 1e-6) << "the mesh is below the reference, whose normals are up";
    EXPECT_NEAR(c.chamfer, 0.25, 1e-6);
    EXPECT_NEAR(c.normal_degrees, 0, 1e-3);
    EXPECT_EQ(c.f_scores[0].f(), 0);
    EXPECT_EQ(c.f_scores[1].f(), 1);
}

TEST(CompareMeshes, a_missing_half_lowers_recall_alone) {
    const TriangleMesh whole = square_mesh(2, 8);
    TriangleMesh half = whole;
    std::erase_if(half.face, [&](const auto& f) {
        return half.position[f[0]].x >= 1 || half.position[f[1]].x > 1;
    });
    CompareOptions options;
    options.spacing = 0.02;
    options.thresholds = {0.05};
    options.left_out = 0.5;
    const MeshComparison c = compare_meshes(half, whole, options, "reference");
    EXPECT_NEAR(c.f_scores[0].precision, 1, 1e-12);
    EXPECT_NEAR(c.f_scores[0].recall, 0.525, 0.002);
    EXPECT_NEAR(c.completeness.mean, 0.25, 0.002) << "half at 0 to 1: a mean of 0.5, and half at 0";
    EXPECT_NEAR(c.completeness.p90, 0.8, 0.005);
    EXPECT_NEAR(c.left_out_share, 0.25 / 1.5, 0.002);
    // What no camera sees does not count.
    options.counts = [](const glm::dvec3& p) { return p.x < 1; };
    EXPECT_NEAR(compare_meshes(half, whole, options, "reference").f_scores[0].recall, 1, 1e-12);
    options.counts = [](const glm::dvec3&) { return false; };
    EXPECT_NE(refusal([&] {
                  compare_meshes(half, whole, options, "r.ply");
              }).find("r.ply: there is nothing to compare"),
              std::string::npos);
}

TEST(CompareMeshes, points_are_thinned_and_searched) {
    TriangleMesh points;
    for (int x = 0; x < 200; ++x)
        for (int y = 0; y < 200; ++y) {
            points.position.emplace_back(0.01f * float(x), 0.01f * float(y), 0.03f);
            points.normal.emplace_back(0.0f, 0.0f, -1.0f);
        }
    CompareOptions options;
    options.spacing = 0.05;
    const MeshComparison c = compare_meshes(square_mesh(2, 3), points, options, "points");
    EXPECT_NEAR(double(c.completeness.samples), 1600, 90) << "one in each cell of 5 x 5 points";
    EXPECT_NEAR(c.completeness.largest, 0.03, 1e-6);
    EXPECT_NEAR(c.accuracy.median, 0.0303, 0.0005) << "to all points, not to the thinned ones";
    EXPECT_NEAR(c.bias, 0.03, 1e-6) << "their normals are down";
    points.normal.clear();
    EXPECT_TRUE(std::isnan(compare_meshes(square_mesh(2, 3), points, options, "p").bias));
}

TEST(CompareMeshes, a_reference_far_off_is_asked_for_its_unit) {
    const TriangleMesh mesh = sphere_mesh(1, 16, 16);
    TriangleMesh millimetres = mesh;
    for (glm::vec3& p : millimetres.position) p *= 1000.0f;
    CompareOptions options;
    options.spacing = 0.05;
    options.far_off = 100;
    const std::string error =
        refusal([&] { compare_meshes(mesh, millimetres, options, "scan.ply"); });
    EXPECT_NE(error.find("scan.ply: half of it lies more than"), std::string::npos) << error;
    EXPECT_NE(error.find("Is it in mm"), std::string::npos) << error;
    TriangleMesh moved = mesh;
    moved.origin = {5000, 0, 0};
    EXPECT_NE(refusal([&] {
                  compare_meshes(mesh, moved, options, "moved.ply");
              }).find("into the frame of the scene"),
              std::string::npos);
    moved.origin = {1, 0, 0};
    EXPECT_EQ(refusal([&] { compare_meshes(mesh, moved, options, "near.ply"); }), "no error");
}

TEST(PlacedShapes, distances_are_exact) {
    const glm::dvec3 size(0.5, 0.2, 0.4);
    const auto at = [&](ShapeKind kind, const glm::dvec3& p) {
        return signed_distance(PlacedShape{kind, size}, p);
    };
    EXPECT_NEAR(at(ShapeKind::sphere, {0, 3, 4}), 4.5, 1e-12);
    EXPECT_NEAR(at(ShapeKind::box, {0.5 + 0.3, 0.2 + 0.4, 0}), 0.5, 1e-12);
    EXPECT_NEAR(at(ShapeKind::box, {0.1, 0.05, 0.1}), -0.15, 1e-12);
    EXPECT_NEAR(at(ShapeKind::cylinder, {0.8, 0, 0.8}), 0.5, 1e-12);
    EXPECT_NEAR(at(ShapeKind::cylinder, {0.45, 0, 0}), -0.05, 1e-12);
    EXPECT_NEAR(at(ShapeKind::torus, {0.5, 0, 0.3}), 0.1, 1e-12);
    EXPECT_NEAR(at(ShapeKind::torus, {0, 0, 0}), 0.3, 1e-12);
    EXPECT_NEAR(at(ShapeKind::plane, {7, 8, -2}), -2, 1e-12);
    EXPECT_NEAR(at(ShapeKind::cone, {0, 0, 0.9}), 0.5, 1e-12);
    EXPECT_NEAR(at(ShapeKind::cone, {0.9, 0, -0.7}), 0.5, 1e-12) << "from the rim of the base";
    const glm::dvec2 out = glm::normalize(glm::dvec2(0.8, 0.3));  // the side's normal
    EXPECT_NEAR(at(ShapeKind::cone, {0.35 + 0.1 * out.x, 0, 0.1 * out.y}), 0.1, 1e-12);
    EXPECT_NEAR(at(ShapeKind::cone, {0.35 - 0.1 * out.x, 0, -0.1 * out.y}), -0.1, 1e-12);
    const PlacedShape turned{
        ShapeKind::box, {1, 2, 3}, {10, 0, 0}, glm::dmat3(0, 1, 0, -1, 0, 0, 0, 0, 1)};
    EXPECT_NEAR(signed_distance(turned, {10 + 2.5, 0, 0}), 0.5, 1e-12) << "a quarter turn about z";
}

TEST(PlacedShapes, a_mesh_of_a_sphere_lies_within_by_its_sagitta) {
    const TriangleMesh mesh = sphere_mesh(1, 64, 128);
    const std::vector<PlacedShape> shapes = {{ShapeKind::sphere, glm::dvec3(1.0)}};
    CompareOptions options;
    options.spacing = 0.02;
    options.thresholds = {0.001};
    const MeshComparison c = compare_with_shapes(mesh, shapes, options, "shapes");
    const double sagitta = 1 - std::cos(std::numbers::pi / 64);
    EXPECT_LT(c.accuracy.largest, sagitta);
    EXPECT_GT(c.accuracy.largest, 0.4 * sagitta);
    EXPECT_NEAR(c.bias, -c.accuracy.mean, 1e-12);
    EXPECT_LT(c.normal_degrees, 3);
    EXPECT_GT(c.f_scores[0].precision, 0.9);
    EXPECT_EQ(c.completeness.samples, 0u);
}

TEST(PlacedShapes, file_is_read_back_and_mistakes_are_named) {
    const std::filesystem::path path =
        std::filesystem::path(testing::TempDir()) / fmt::format("shapes_{}.json", ::getpid());
    const std::vector<PlacedShape> shapes = {
        {ShapeKind::cone, {1, 2, 3}, {4, 5, 6}, glm::dmat3(0, 1, 0, -1, 0, 0, 0, 0, 1)},
        {ShapeKind::plane, {0, 0, 0}, {0, 0, -0.1}}};
    write_file_atomic(path, format_shapes(shapes));
    const std::vector<PlacedShape> read = read_shapes(path);
    ASSERT_EQ(read.size(), 2u);
    EXPECT_EQ(read[0].kind, ShapeKind::cone);
    EXPECT_EQ(read[0].size, shapes[0].size);
    EXPECT_EQ(read[0].position, shapes[0].position);
    EXPECT_EQ(read[0].rotation, shapes[0].rotation);
    EXPECT_EQ(read[1].kind, ShapeKind::plane);
    std::string text = format_shapes(shapes);
    write_file_atomic(path, text.replace(text.find("cone"), 4, "cube"));
    EXPECT_NE(refusal([&] { read_shapes(path); }).find("shape 0: has the unknown shape 'cube'"),
              std::string::npos);
    write_file_atomic(path, std::string_view("{\"shapes\": [{\"shape\": \"box\"}]}"));
    EXPECT_NE(refusal([&] { read_shapes(path); }).find("size"), std::string::npos);
    std::filesystem::remove(path);
}

}  // namespace
}  // namespace darb::test
