// SPDX-License-Identifier: MIT
// Splats before a wall that cameras look through, against where they were put.
#include "engine/render/free_space.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/rng.h"
#include "tests/support/shared_device.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

/// At x, 0, 0, looking along z.
Camera camera_in_room(double x) {
    Camera c;
    c.width = 160;
    c.height = 120;
    c.fx = c.fy = 150;
    c.cx = 80;
    c.cy = 60;
    c.translation = {-x, 0, 0};
    return c;
}

struct RoomWithFloaters {
    SplatModel model;
    std::size_t faint = 0, dense = 0, behind = 0;  // the first splats of each kind
    std::vector<Camera> cameras;
};

/// An opaque wall at z = 5; faint splats halfway to it, an opaque ball there, and splats behind the
/// wall.
RoomWithFloaters room_with_floaters() {
    RoomWithFloaters r;
    Pcg32 rng(3);
    for (int i = 0; i < 3000; ++i)
        append_splat({8 * rng.uniform() - 4, 6 * rng.uniform() - 3, 5}, glm::dvec3(0.12), 4,
                     r.model);
    r.faint = r.model.size();
    for (int i = 0; i < 6; ++i)
        append_splat({0.3 * i - 0.75, 0.4, 2.5}, glm::dvec3(0.05), -2.5, r.model);
    r.dense = r.model.size();
    for (int i = 0; i < 300; ++i) {
        const glm::dvec3 way(rng.normal(), rng.normal(), rng.normal());
        append_splat(glm::dvec3(0, -0.4, 2.5) + 0.15 * glm::normalize(way), glm::dvec3(0.03), 4,
                     r.model);
    }
    r.behind = r.model.size();
    for (int i = 0; i < 5; ++i)
        append_splat({0.3 * i - 0.6, 0, 8}, glm::dvec3(0.05), -2.5, r.model);
    for (int v = 0; v < 5; ++v) r.cameras.push_back(camera_in_room(0.2 * v - 0.4));
    return r;
}

SplatSet found_in_space(const RoomWithFloaters& r, const FreeSpaceOptions& options = {}) {
    Renderer renderer(shared_device(), r.model);
    FreeSpace space(r.model, options);
    for (const Camera& camera : r.cameras) space.ask(renderer, camera);
    return space.splats();
}

TEST(FreeSpace, is_before_a_surface_and_faint) {
    const RoomWithFloaters r = room_with_floaters();
    const SplatSet set = found_in_space(r);
    for (std::size_t i = 0; i < r.model.size(); ++i)
        EXPECT_EQ(set[i], i >= r.faint && i < r.dense ? 1 : 0) << i;
    FreeSpaceOptions more;
    more.least_views = 6;  // than there are cameras
    EXPECT_EQ(count_of(found_in_space(r, more)), 0u);
}

// A single camera finds a surface where two faint splats take a quarter of its light together.
TEST(FreeSpace, ends_where_enough_light_is_taken) {
    RoomWithFloaters r = room_with_floaters();
    for (int i = 0; i < 6; ++i)
        append_splat({0.3 * i - 0.75, 0.4, 2.5}, glm::dvec3(0.05), -1, r.model);
    FreeSpaceOptions sparing;
    sparing.taken = 0.2;
    const SplatSet set = found_in_space(r, sparing);
    for (std::size_t i = r.faint; i < r.dense; ++i) EXPECT_EQ(set[i], 0) << i;
    EXPECT_EQ(count_of(found_in_space(r)), 12u);
}

TEST(FreeSpace, scales_wide_cameras_down) {
    const RoomWithFloaters r = room_with_floaters();
    FreeSpaceOptions narrow;
    narrow.width = 80;
    const SplatSet set = found_in_space(r, narrow);
    for (std::size_t i = r.faint; i < r.dense; ++i) EXPECT_EQ(set[i], 1) << i;
}

}  // namespace
}  // namespace darb::test
