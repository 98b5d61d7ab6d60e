// SPDX-License-Identifier: MIT
#include "viewer/picture_pacing.h"

#include <gtest/gtest.h>

#include "engine/scene/edit_splats.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

std::vector<SplatModel> all_of(MotionLevels& levels) {
    std::vector<SplatModel> taken;
    for (bool done = false; !done;) {
        done = levels.done();
        while (std::optional<SplatModel> level = levels.take()) taken.push_back(std::move(*level));
        std::this_thread::yield();
    }
    return taken;
}

TEST(MotionLevels, come_in_order_without_deleted_splats) {
    const SplatModel scene = sample_model(1, 2000);
    std::vector<std::uint8_t> removed(2000);
    for (std::size_t i = 0; i < 2000; ++i) removed[i] = scene.position[3 * i] > 0;
    std::atomic<int> wakes{0};
    MotionLevels levels(scene, removed, {800, 300, 50}, [&] { ++wakes; });
    const std::vector<SplatModel> taken = all_of(levels);
    ASSERT_EQ(taken.size(), 6u);  // quickly, and again
    for (std::size_t i = 0; i < 6; ++i)
        EXPECT_EQ(taken[i].size(), (std::vector<std::size_t>{800, 300, 50})[i % 3]) << i;
    EXPECT_NE(taken[0].position, taken[3].position);
    EXPECT_EQ(wakes, 7);  // each level, and the end
    for (const SplatModel& level : taken)
        for (std::size_t i = 0; i < level.size(); ++i) EXPECT_LE(level.position[3 * i], 0);
}

TEST(MotionLevels, end_early_where_they_are_cancelled) {
    MotionLevels levels(sample_model(3, 30'000), {}, {20'000, 10'000, 5'000, 100}, {});
    levels.cancel();
    EXPECT_LT(all_of(levels).size(), 8u);
}

}  // namespace
}  // namespace darb::test
