// SPDX-License-Identifier: MIT
// The scene helper: what it promises to the tests that use it.
#include "tests/support/test_scene.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_data.h"

namespace darb::test {
namespace {

TEST(RandomScene, SameSeed_GivesTheSameScene) {
    const TestScene a = random_scene(), b = random_scene();
    EXPECT_EQ(a.model.position, b.model.position);
    EXPECT_EQ(a.model.sh_rest, b.model.sh_rest);
    EXPECT_EQ(a.camera.rotation, b.camera.rotation);
    EXPECT_NE(a.model.position, random_scene({.seed = 2}).model.position);
}

TEST(RandomScene, Camera_IsRigidAndSeesMostMeans) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const TestScene scene = random_scene({.count = 50, .seed = seed});
        const Camera& camera = scene.camera;
        const glm::dmat3 square = camera.rotation * glm::transpose(camera.rotation);
        for (int c = 0; c < 3; ++c) {
            for (int r = 0; r < 3; ++r) {
                EXPECT_NEAR(square[c][r], c == r ? 1.0 : 0.0, 1e-14) << "seed " << seed;
            }
        }
        EXPECT_NEAR(glm::determinant(camera.rotation), 1.0, 1e-14) << "seed " << seed;
        int seen = 0;
        for (size_t i = 0; i < scene.model.size(); ++i) {
            const float* p = &scene.model.position[i * 3];
            const glm::dvec3 at =
                camera.rotation * glm::dvec3(p[0], p[1], p[2]) + camera.translation;
            const double x = camera.fx * at.x / at.z + camera.cx;
            const double y = camera.fy * at.y / at.z + camera.cy;
            seen += at.z > 1 && x > 0 && x < camera.width && y > 0 && y < camera.height ? 1 : 0;
        }
        EXPECT_GE(seen, 25) << "of 50, seed " << seed;
    }
}

TEST(RotationOf, QuarterTurnQuaternion_TurnsXIntoY) {
    const glm::dvec3 turned =
        rotation_of(std::sqrt(0.5), 0, 0, std::sqrt(0.5)) * glm::dvec3(1, 0, 0);
    EXPECT_NEAR(turned.x, 0, 1e-15);
    EXPECT_NEAR(turned.y, 1, 1e-15);
    EXPECT_NEAR(turned.z, 0, 1e-15);
}

TEST(TestDataFolder, NamedFolderThatIsNone_IsNothing) {
    ASSERT_EQ(setenv("DARB_TEST_DATA", "/no/such/folder", 1), 0);
    EXPECT_FALSE(test_data_folder().has_value());
    ASSERT_EQ(setenv("DARB_TEST_DATA", DARB_SOURCE_DIR, 1), 0);
    EXPECT_TRUE(test_data_folder().has_value());
    unsetenv("DARB_TEST_DATA");
}

}  // namespace
}  // namespace darb::test
