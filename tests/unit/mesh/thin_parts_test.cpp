// SPDX-License-Identifier: MIT
// Which blocks count as lost: those with depths from both sides and no mesh nearby.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/mesh/scene_mesh.h"
#include "tests/support/mesh_shapes.h"

namespace darb::test {
namespace {

/// A camera on the z axis that looks at the plane z = 0 from `z`, and sees it.
DepthView view_from(double z) {
    DepthView view;
    view.camera.width = view.camera.height = 60;
    view.camera.fx = view.camera.fy = 60;
    view.camera.cx = view.camera.cy = 30;
    if (z > 0) view.camera.rotation = glm::dmat3(1, 0, 0, 0, -1, 0, 0, 0, -1);
    view.camera.translation = view.camera.rotation * glm::dvec3(0, 0, -z);
    view.depth.assign(3600, static_cast<float>(std::abs(z)));
    return view;
}

TEST(ThinBlocks, are_seen_from_both_sides_and_have_no_mesh) {
    TsdfOptions options;
    options.voxel = 0.05;
    options.farthest = 100;
    const std::vector<DepthView> front{view_from(-2)}, both{view_from(-2), view_from(2)};
    const TriangleMesh none;
    EXPECT_EQ(share_of_thin_blocks(both, none, options), 1);
    EXPECT_EQ(share_of_thin_blocks(front, none, options), 0) << "nobody saw its back";
    TriangleMesh sheet = square_mesh(4, 80);
    for (glm::vec3& p : sheet.position) p -= glm::vec3(2, 2, 0);
    EXPECT_EQ(share_of_thin_blocks(both, sheet, options), 0);
    for (glm::vec3& p : sheet.position) p.x += 2;  // covers the half with x > 0
    EXPECT_NEAR(share_of_thin_blocks(both, sheet, options), 0.5, 0.15);
    options.bounds = WorldBox{glm::dvec3(0.3, -2, -1), glm::dvec3(2, 2, 1)};
    EXPECT_EQ(share_of_thin_blocks(both, sheet, options), 0) << "outside the bounds nothing counts";
    options.bounds.reset();
    options.farthest = 1;
    EXPECT_EQ(share_of_thin_blocks(both, none, options), 0) << "beyond the largest depth";
}

}  // namespace
}  // namespace darb::test
