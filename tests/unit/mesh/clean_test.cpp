// SPDX-License-Identifier: MIT
// Topology of known shapes; each step of cleaning on a mesh that needs it; simplification.
#include "engine/mesh/clean.h"

#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/mesh/surface_search.h"
#include "engine/mesh/topology.h"
#include "tests/support/mesh_shapes.h"

namespace darb::test {
namespace {

double volume_of(const TriangleMesh& mesh) {
    double volume = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        volume += glm::dot(face_cross(mesh, f), glm::dvec3(mesh.position[mesh.face[f][0]])) / 6;
    return volume;
}

void remove_face(std::size_t f, TriangleMesh& mesh) {
    mesh.face.erase(mesh.face.begin() + static_cast<std::ptrdiff_t>(f));
}

void expect_closed_manifold(const TriangleMesh& mesh, long genus) {
    const Topology t = topology_of(mesh);
    EXPECT_TRUE(t.is_closed()) << t.rim_edges << " edges of rims";
    EXPECT_TRUE(t.is_manifold()) << t.crowded_edges << " crowded, " << t.turned_edges << " turned, "
                                 << t.pinched_vertices << " pinched";
    EXPECT_EQ(t.genus(), genus);
}

TEST(MeshTopology, shapes_have_their_characteristic) {
    expect_closed_manifold(box_mesh(glm::vec3(0), glm::vec3(1)), 0);
    expect_closed_manifold(torus_mesh(1, 0.3, 9, 7), 1);
    TriangleMesh two = torus_mesh(1, 0.3, 9, 7);
    append_mesh(box_mesh(glm::vec3(4), glm::vec3(5)), two);
    EXPECT_EQ(topology_of(two).parts, 2u);
    EXPECT_EQ(topology_of(two).euler(), 2);
    const Topology square = topology_of(square_mesh(3, 5));
    EXPECT_FALSE(square.is_closed());
    EXPECT_TRUE(square.is_manifold());
    EXPECT_EQ(square.rim_edges, 20u);
    EXPECT_EQ(square.rims, 1u);
    EXPECT_NEAR(square.rim_length, 12, 1e-6);
    EXPECT_EQ(square.euler(), 1);
}

TEST(MeshTopology, faults_are_counted) {
    TriangleMesh turned = box_mesh(glm::vec3(0), glm::vec3(1));
    std::swap(turned.face[3][0], turned.face[3][1]);
    EXPECT_EQ(topology_of(turned).turned_edges, 3u);
    TriangleMesh crowded = square_mesh(1, 1);
    crowded.position.emplace_back(0.0f, 0.0f, 1.0f);
    crowded.face.push_back({0, 3, 4});
    EXPECT_EQ(topology_of(crowded).crowded_edges, 1u);
    TriangleMesh pinched = square_mesh(1, 1);
    pinched.position.insert(pinched.position.end(), {glm::vec3(2, 1, 0), glm::vec3(2, 2, 0)});
    pinched.face.push_back({3, 4, 5});
    EXPECT_EQ(topology_of(pinched).pinched_vertices, 1u);
    EXPECT_FALSE(topology_of(pinched).is_manifold());
}

TEST(CleanMesh, faces_without_area_go_and_leave_no_crack) {
    // A square whose left half meets the right one in a vertex more: a flat face closes the gap.
    TriangleMesh mesh;
    mesh.position = {{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {0, 2, 0}, {1, 1, 0}, {2, 1, 0}, {1, 1, 0}};
    mesh.face = {{0, 1, 3}, {1, 2, 3}, {1, 4, 2}, {1, 5, 4}, {6, 5, 2}, {4, 6, 2}, {4, 5, 6}};
    ASSERT_EQ(topology_of(mesh).rims, 1u);
    const CleanReport report = clean_mesh(mesh, {});
    EXPECT_EQ(report.faces_without_area, 3u);
    EXPECT_EQ(mesh.face_count(), 5u);
    const Topology t = topology_of(mesh);
    EXPECT_EQ(t.rims, 1u);
    EXPECT_EQ(t.rim_edges, 5u) << "a crack would have edges of its own";
    double area = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        area += glm::length(face_cross(mesh, f)) / 2;
    EXPECT_NEAR(area, 3, 1e-6);
}

TEST(CleanMesh, small_parts_go_by_faces_extent_and_number) {
    TriangleMesh mesh = torus_mesh(1, 0.3, 12, 8);            // 192 faces, 2.6 wide
    append_mesh(box_mesh(glm::vec3(4), glm::vec3(6)), mesh);  // 12 faces, 2 wide
    append_mesh(torus_mesh(0.05, 0.01, 12, 8), mesh);         // 192 faces, 0.12 wide
    mesh.colour.assign(mesh.vertex_count(), glm::u8vec3(1, 2, 3));
    TriangleMesh few = mesh;
    CleanReport report = clean_mesh(few, {.min_faces = 50});
    EXPECT_EQ(report.parts, 3u);
    EXPECT_EQ(report.parts_removed, 1u);
    EXPECT_EQ(report.part_faces_removed, 12u);
    EXPECT_EQ(few.vertex_count(), 192u);
    EXPECT_EQ(few.colour.size(), few.vertex_count());
    TriangleMesh wide = mesh;
    clean_mesh(wide, {.min_extent = 1});
    EXPECT_EQ(wide.face_count(), 204u);
    TriangleMesh largest = mesh;
    clean_mesh(largest, {.keep = 1});
    EXPECT_EQ(largest.face_count(), 12u) << "the box has the largest area, and fewest faces";
    TriangleMesh none = mesh;
    clean_mesh(none, {.min_faces = 1000});
    EXPECT_EQ(none.vertex_count(), 0u);
}

TEST(CleanMesh, what_touches_in_a_vertex_or_an_edge_is_split) {
    // Two boxes that share an edge: four faces meet there, and solid lies on two sides of it.
    TriangleMesh edge = box_mesh(glm::vec3(0), glm::vec3(1));
    append_mesh(box_mesh(glm::vec3(1, 1, 0), glm::vec3(2, 2, 1)), edge);
    for (auto& face : edge.face)
        for (std::uint32_t& v : face) v = v == 8 ? 3 : v == 12 ? 7 : v;
    EXPECT_EQ(topology_of(edge).crowded_edges, 1u);
    EXPECT_EQ(clean_mesh(edge, {}).vertices_split, 2u);
    expect_closed_manifold(edge, 0);
    EXPECT_EQ(topology_of(edge).parts, 2u) << "each box for itself, not a tube between them";
    EXPECT_NEAR(volume_of(edge), 2, 1e-6);
    // Two in a vertex.
    TriangleMesh corner = box_mesh(glm::vec3(0), glm::vec3(1));
    append_mesh(box_mesh(glm::vec3(1), glm::vec3(2)), corner);
    for (auto& face : corner.face)
        for (std::uint32_t& v : face) v = v == 8 ? 7 : v;
    EXPECT_EQ(topology_of(corner).pinched_vertices, 1u);
    EXPECT_EQ(clean_mesh(corner, {}).vertices_split, 1u);
    expect_closed_manifold(corner, 0);
}

TEST(CleanMesh, an_edge_that_a_surface_meets_twice_is_halved) {
    // A tunnel through solid whose square ring 0 is pinched to an edge: solid lies above and below
    // it, and each of its ends is still one fan.
    TriangleMesh mesh = torus_mesh(1, 0.3, 6, 4);
    for (auto& face : mesh.face) {
        std::swap(face[0], face[1]);
        for (std::uint32_t& v : face) v = v == 3 ? 0 : v == 2 ? 1 : v;
    }
    std::erase_if(mesh.face, [](const auto& face) {
        return face[0] == face[1] || face[1] == face[2] || face[2] == face[0];
    });
    ASSERT_EQ(topology_of(mesh).crowded_edges, 1u);
    ASSERT_EQ(topology_of(mesh).pinched_vertices, 0u);
    const std::size_t faces = mesh.face_count();
    EXPECT_EQ(clean_mesh(mesh, {}).vertices_split, 1u);
    EXPECT_EQ(mesh.face_count(), faces + 2);
    expect_closed_manifold(mesh, 1);
}

TEST(CleanMesh, holes_below_the_length_are_filled_and_no_others) {
    TriangleMesh mesh = square_mesh(10, 10);
    remove_face(2 * 55, mesh);  // a triangle of sides 1, 1 and the diagonal
    remove_face(2 * 22, mesh);
    remove_face(2 * 22, mesh);  // a square
    const TriangleMesh holed = mesh;
    EXPECT_EQ(topology_of(mesh).rims, 3u);
    CleanReport report = clean_mesh(mesh, {.longest_rim = 3.9});
    EXPECT_EQ(report.holes_filled, 1u);
    EXPECT_EQ(report.holes_left, 2u);
    mesh = holed;
    report = clean_mesh(mesh, {.longest_rim = 5});
    EXPECT_EQ(report.holes_filled, 2u);
    EXPECT_EQ(report.faces_filled, 3u);
    EXPECT_EQ(topology_of(mesh).rims, 1u);
    EXPECT_TRUE(topology_of(mesh).is_manifold());
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        EXPECT_GT(face_cross(mesh, f).z, 0) << "fills turn as their neighbours do, face " << f;
    mesh = holed;
    report = clean_mesh(
        mesh, {.longest_rim = 5, .may_fill = [](auto triangles) { return triangles.size() == 1; }});
    EXPECT_EQ(report.holes_filled, 1u);
    EXPECT_EQ(report.holes_forbidden, 1u);
}

TEST(CleanMesh, fill_has_the_least_area) {
    // A box without a wall, one of whose corners is pulled out: which corner says which of the two
    // diagonals is the smaller fill.
    for (const std::size_t pulled : {1u, 3u, 5u, 7u}) {
        TriangleMesh mesh = box_mesh(glm::vec3(0), glm::vec3(1, 4, 1));
        mesh.face.resize(mesh.face.size() - 2);  // the wall at x = 1
        mesh.position[pulled].x = 2;
        const CleanReport report = clean_mesh(mesh, {.longest_rim = 100});
        EXPECT_EQ(report.faces_filled, 2u);
        expect_closed_manifold(mesh, 0);
        double filled = 0;
        for (std::size_t f = 10; f < 12; ++f) filled += glm::length(face_cross(mesh, f)) / 2;
        const auto area = [&](std::size_t a, std::size_t b, std::size_t c) {
            const glm::dvec3 p(mesh.position[a]);
            return glm::length(glm::cross(glm::dvec3(mesh.position[b]) - p,
                                          glm::dvec3(mesh.position[c]) - p)) /
                   2;
        };
        const double along = area(1, 3, 7) + area(1, 7, 5), across = area(1, 3, 5) + area(3, 7, 5);
        EXPECT_GT(std::abs(along - across), 0.01);
        EXPECT_NEAR(filled, std::min(along, across), 1e-6) << pulled;
    }
}

TEST(CleanMesh, a_lone_face_is_not_filled_with_its_back) {
    TriangleMesh mesh;
    mesh.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.face = {{0, 1, 2}};
    EXPECT_EQ(clean_mesh(mesh, {.longest_rim = 100}).holes_left, 1u);
    EXPECT_EQ(mesh.face_count(), 1u);
}

TEST(CleanMesh, neighbours_are_turned_to_agree_and_to_face_outside) {
    TriangleMesh mesh = sphere_mesh(1, 8, 10);
    const TriangleMesh right = mesh;
    for (std::size_t f = 0; f < mesh.face_count(); f += 3)
        std::swap(mesh.face[f][0], mesh.face[f][1]);
    CleanReport report = clean_mesh(mesh, {.orient = true});
    EXPECT_EQ(report.faces_turned, (right.face_count() + 2) / 3);
    EXPECT_EQ(report.edges_not_turned, 0u);
    EXPECT_NEAR(volume_of(mesh), volume_of(right), 1e-6);
    report =
        clean_mesh(mesh, {.orient = true, .outside = [](const glm::vec3& p, const glm::vec3& n) {
                              return -double(glm::dot(p, n));  // seen from within
                          }});
    EXPECT_EQ(report.faces_turned, right.face_count());
    EXPECT_NEAR(volume_of(mesh), -volume_of(right), 1e-6);
    EXPECT_LT(glm::dot(mesh.normal[5], mesh.position[5]), 0) << "normals follow";
    // A Moebius strip has one side.
    TriangleMesh strip;
    constexpr std::uint32_t kSteps = 12;
    for (std::uint32_t i = 0; i < kSteps; ++i)
        for (const double side : {-0.3, 0.3}) {
            const double a = 2 * std::numbers::pi * i / kSteps;
            const double r = 1 + side * std::cos(a / 2);
            strip.position.emplace_back(r * std::cos(a), r * std::sin(a), side * std::sin(a / 2));
        }
    for (std::uint32_t i = 0; i < kSteps; ++i) {
        const bool last = i + 1 == kSteps;
        const std::uint32_t a = 2 * i, b = a + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
        strip.face.push_back({a, b, d});
        strip.face.push_back({a, d, c});
    }
    EXPECT_GT(clean_mesh(strip, {.orient = true}).edges_not_turned, 0u);
    EXPECT_TRUE(topology_of(strip).is_manifold()) << "cut where the sides disagree";
}

TEST(SurfaceSearch, finds_what_every_face_says) {
    const TriangleMesh mesh = torus_mesh(1, 0.3, 23, 17);
    const SurfaceSearch search(mesh);
    for (int i = 0; i < 200; ++i) {
        const glm::dvec3 p(std::sin(1.3 * i) * 2, std::cos(2.1 * i) * 2, std::sin(0.7 * i));
        double least = 1e300;
        for (const auto& face : mesh.face)
            least = std::min(
                least, glm::distance(p, nearest_on_triangle(p, glm::dvec3(mesh.position[face[0]]),
                                                            glm::dvec3(mesh.position[face[1]]),
                                                            glm::dvec3(mesh.position[face[2]]))));
        const NearestPoint found = search.nearest(p);
        EXPECT_NEAR(found.distance, least, 1e-12) << i;
        EXPECT_NEAR(glm::distance(found.point, p), least, 1e-12);
        EXPECT_TRUE(std::isinf(search.nearest(p, 0.9 * least).distance));
        EXPECT_NEAR(search.nearest(p, 1.1 * least).distance, least, 1e-12);
    }
    const glm::dvec3 a(0), b(1, 0, 0), c(0, 1, 0);
    EXPECT_EQ(nearest_on_triangle({2, -1, 1}, a, b, c), b);
    EXPECT_EQ(nearest_on_triangle({0.25, -1, 1}, a, b, c), glm::dvec3(0.25, 0, 0));
    EXPECT_EQ(nearest_on_triangle({0.25, 0.25, 1}, a, b, c), glm::dvec3(0.25, 0.25, 0));
    EXPECT_EQ(nearest_on_triangle({1, 1, 1}, a, b, c), glm::dvec3(0.5, 0.5, 0));
}

TEST(SimplifyMesh, keeps_shape_topology_and_rims) {
    if (!can_simplify()) GTEST_SKIP() << "built without meshoptimizer";
    const TriangleMesh torus = torus_mesh(1, 0.3, 80, 40);
    const Simplified simple = simplify_mesh(torus, 800);
    EXPECT_LE(simple.mesh.face_count(), 800u);
    EXPECT_GE(simple.mesh.face_count(), 600u);
    expect_closed_manifold(simple.mesh, 1);
    EXPECT_GT(simple.largest_distance, 1e-4);
    EXPECT_LT(simple.largest_distance, 0.05);
    const Simplified flat = simplify_mesh(square_mesh(4, 12), 40);
    EXPECT_NEAR(topology_of(flat.mesh).rim_length, 16, 1e-5);
    EXPECT_LT(topology_of(flat.mesh).rim_edges, 40u) << "a straight rim needs few vertices";
    EXPECT_LT(flat.largest_distance, 1e-6);
    EXPECT_EQ(simplify_mesh(torus, 1000000).mesh.face, torus.face);
}

// Half of the vertices of such a surface lie on rims. If those stayed, the few others would have to
// carry all that is asked for, as triangles far from the surface.
TEST(SimplifyMesh, ragged_surfaces_become_as_small_as_asked) {
    if (!can_simplify()) GTEST_SKIP() << "built without meshoptimizer";
    TriangleMesh ragged = square_mesh(4, 80);
    for (glm::vec3& p : ragged.position) p.z = 0.2f * std::sin(2 * p.x) * std::cos(3 * p.y);
    std::erase_if(ragged.face, [](const auto& face) {
        return face[0] % 81 % 6 < 3 && face[0] / 81 % 6 < 3 && face[0] % 81 > 2 && face[0] > 162;
    });
    const Simplified simple = simplify_mesh(ragged, 3000);
    EXPECT_LE(simple.mesh.face_count(), 3000u);
    EXPECT_GE(simple.mesh.face_count(), 2500u);
    EXPECT_LT(simple.largest_distance, 0.02);
    EXPECT_EQ(topology_of(simple.mesh).parts, topology_of(ragged).parts);
}

TEST(SimplifyMesh, without_the_library_names_the_package) {
    if (can_simplify()) GTEST_SKIP() << "built with meshoptimizer";
    try {
        simplify_mesh(torus_mesh(1, 0.3, 8, 8), 10);
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_NE(error.hint.find("libmeshoptimizer-dev"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace darb::test
