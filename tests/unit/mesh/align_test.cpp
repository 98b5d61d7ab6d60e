// SPDX-License-Identifier: MIT
// References that were turned, moved and scaled come back onto the mesh.
#include "engine/mesh/align.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/mesh/compare.h"
#include "tests/support/mesh_shapes.h"

namespace darb::test {
namespace {

using glm::dvec3;

/// Two boxes that no turn maps onto themselves.
TriangleMesh blocks() {
    TriangleMesh mesh = box_mesh(glm::vec3(0, 0, 0), glm::vec3(1, 0.6f, 0.4f));
    append_mesh(box_mesh(glm::vec3(1.2f, 0, 0), glm::vec3(1.5f, 0.3f, 0.9f)), mesh);
    return mesh;
}

Alignment displaced(double degrees, const dvec3& shift, double scale) {
    Alignment away;
    away.rotation = glm::dmat3(
        glm::rotate(glm::dmat4(1.0), glm::radians(degrees), glm::normalize(dvec3(1, 2, -0.5))));
    away.shift = shift;
    away.scale = scale;
    return away;
}

void expect_back(const Alignment& away, AlignKind kind) {
    TriangleMesh mesh = blocks();
    mesh.origin = {1000, -200, 30};
    const TriangleMesh reference = moved_mesh(away, mesh);
    const Alignment found = align_to_mesh(mesh, reference, kind, 0.03);
    EXPECT_NEAR(found.scale * away.scale, 1, 1e-4);
    EXPECT_LT(found.after, 1e-4) << "before " << found.before;
    EXPECT_GT(found.before, 0.01);
    for (const dvec3& p : {dvec3(1000, -200, 30), dvec3(1001.5, -199.7, 30.9)})
        EXPECT_LT(glm::distance(found.apply(away.apply(p)), p), 1e-3);
}

TEST(AlignToMesh, rigid_turns_and_moves_back) {
    expect_back(displaced(12, dvec3(0.1, -0.05, 0.2), 1), AlignKind::rigid);
    expect_back(displaced(30, dvec3(0.1, 0, 0), 1), AlignKind::rigid);
    // About the world's origin, a thousand units away: far off until the middles meet.
    expect_back(displaced(3, dvec3(5, 6, 7), 1), AlignKind::rigid);
}

TEST(AlignToMesh, similarity_finds_the_scale) {
    expect_back(displaced(8, dvec3(0.1, 0, 0.1), 1.3), AlignKind::similarity);
    expect_back(displaced(0, dvec3(0), 1000), AlignKind::similarity);
    TriangleMesh larger = blocks();
    for (glm::vec3& p : larger.position) p *= 1.2f;
    EXPECT_EQ(align_to_mesh(blocks(), larger, AlignKind::rigid, 0.03).scale, 1);
}

TEST(AlignToMesh, takes_points_and_says_what_it_moved) {
    TriangleMesh points;
    double spacing = 0.02;
    for (const dvec3& p : sample_surface(blocks(), spacing).position)
        points.position.emplace_back(p + dvec3(0.05, 0, 0));
    const Alignment found = align_to_mesh(blocks(), points, AlignKind::rigid, 0.02);
    EXPECT_NEAR(found.moved, 0.05, 1e-3);
    EXPECT_LT(found.degrees, 0.1);
    EXPECT_NEAR(found.shift.x, -0.05, 1e-3);
    EXPECT_EQ(align_kind_from_name("similarity"), AlignKind::similarity);
    EXPECT_FALSE(align_kind_from_name("nonrigid"));
}

}  // namespace
}  // namespace darb::test
