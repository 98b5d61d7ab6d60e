// SPDX-License-Identifier: MIT
// Every way of the walk's passes gives equal bits where the tuning says so, and a run keeps the way
// that it began with. walk_test compares both backward blends with double.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "engine/core/rng.h"
#include "engine/plan/tuner.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_device_options.h"
#include "tests/support/test_walk.h"
#include "tests/support/tiny_training.h"
#include "trainer/run/run.h"
#include "trainer/step/checkpoint.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

const SceneOptions kSmallSplats{
    .count = 600, .width = 121, .height = 83, .sh_degree = 1, .max_logit = 1, .seed = 21};

struct WalkScene {
    TestScene scene;
    Image<double> weights{scene.camera.width, scene.camera.height, 3};

    explicit WalkScene(const SceneOptions& options = kSmallSplats) : scene(random_scene(options)) {
        Pcg32 random(3);
        for (double& w : weights.data) w = static_cast<float>(random.uniform(-1, 1));
    }
    DeviceWalk walk() const { return walk_on_device(scene.model, scene.camera, weights, {}); }
};

TEST(TuningWalk, ways_change_bits_only_where_the_table_says_so) {
    const WalkScene s;
    const DeviceWalk usual = s.walk();
    ASSERT_GT(usual.status.intersections, 600U);
    for (const TuningGroup& group : tuning_groups(shared_device().info()))
        for (const std::string& way : group.choices) {
            if (way == group.choices.front()) continue;  // the usual one
            SCOPED_TRACE(group.name + "=" + way);
            const ScopedVariants variants(shared_device(), group.name + "=" + way);
            const DeviceWalk walk = s.walk();
            EXPECT_EQ(walk.status.intersections, usual.status.intersections);
            if (group.name == "blend") {  // rounds q otherwise
                for (std::size_t i = 0; i < walk.image.data.size(); ++i)
                    ASSERT_NEAR(walk.image.data[i], usual.image.data[i], 2e-6);
                continue;
            }
            EXPECT_EQ(walk.image.data, usual.image.data);
            if (!group.changes_bits) {
                EXPECT_EQ(walk.d, usual.d);
            }
        }
}

// Splats over hundreds of tiles, some of them huge.
TEST(TuningWalk, ways_for_large_splats_repeat_and_agree) {
    const WalkScene s({.count = 60,
                       .width = 420,
                       .height = 330,
                       .sh_degree = 1,
                       .min_log_scale = -4,
                       .max_log_scale = 0.5,
                       .min_logit = -3,
                       .max_logit = -1,
                       .seed = 23});
    const DeviceWalk usual = s.walk();
    ASSERT_GT(usual.status.huge_splats, 0U);
    for (const char* way : {"depths=three", "emit=slots", "tiles=longest", "lists=counts",
                            "lists=counts,depths=three,emit=slots,tiles=longest"}) {
        const ScopedVariants variants(shared_device(), way);
        const DeviceWalk walk = s.walk();
        EXPECT_EQ(walk.image.data, usual.image.data) << way;
        EXPECT_EQ(walk.d, usual.d) << way;
        EXPECT_EQ(walk.intersection_count, usual.intersection_count) << way;
        EXPECT_EQ(walk.status.huge_splats, usual.status.huge_splats) << way;
    }
    const ScopedVariants variants(shared_device(), "sums=chunks");
    const DeviceWalk walk = s.walk();
    EXPECT_EQ(walk.d, s.walk().d) << "a rerun";
    EXPECT_NE(walk.d, usual.d) << "both ways summed in one order";
    for (int a = 0; a < kAttributeCount; ++a) {
        double largest = 0;
        for (const float value : usual.d[a]) largest = std::max(largest, std::abs(double{value}));
        for (std::size_t i = 0; i < walk.d[a].size(); ++i)
            ASSERT_NEAR(walk.d[a][i], usual.d[a][i], 1e-5 * largest) << attribute_name(a) << i;
    }
}

// The farthest splat is 100,000 times as far away as the near plane, so the frame is made again.
TEST(TuningWalk, short_depths_give_way_to_long_ones) {
    WalkScene s;
    const glm::dvec3 far_point =
        glm::transpose(s.scene.camera.rotation) *
        (glm::dvec3(0, 0, 1e5 * NEAR_DEFAULT) - s.scene.camera.translation);
    for (int c = 0; c < 3; ++c) {
        s.scene.model.position[static_cast<std::size_t>(c)] = static_cast<float>(far_point[c]);
        s.scene.model.log_scale[static_cast<std::size_t>(c)] = 8;
    }
    s.scene.model.opacity_logit[0] = 3;
    const DeviceWalk usual = s.walk();
    ASSERT_GT(usual.intersection_count[0], 0U) << "it is meant to show";
    const ScopedVariants variants(shared_device(), "depths=three");
    const DeviceWalk walk = s.walk();
    EXPECT_EQ(walk.image.data, usual.image.data);
    EXPECT_EQ(walk.d, usual.d);
    EXPECT_EQ(walk.status.overflow, 0U);
}

// The record names the slower of two forms. A run corrects it for later runs and keeps its own.
TEST(TuningWalk, a_run_looks_again_at_the_record_and_keeps_its_own_bits) {
    const fs::path folder = fs::path(testing::TempDir()) / fmt::format("darb_look_{}", ::getpid());
    fs::create_directories(folder / "cache");
    DeviceOptions of_device = device_options();
    of_device.cache_folder = folder / "cache";
    Device device(of_device);
    TuningRecord record;
    const std::vector<TuningTime> measured = measure_tuning(device, "loss").times;
    ASSERT_EQ(measured.size(), 2U);
    const bool strips_win = measured[0].ms < measured[1].ms;
    const std::string slow = measured[strips_win ? 1 : 0].choice,
                      fast = measured[strips_win ? 0 : 1].choice;
    record.choice = {{"loss", slow}};
    record.times = {{"loss", slow, 1}, {"loss", fast, 2}};
    write_tuning(device.info(), device.cache_folder(), record);

    TinyTraining t = tiny_training({.width = 200, .height = 150});
    t.options.iterations = 201;
    const auto run = [&](const char* name, bool look) {
        RunOptions options;
        options.output = folder / name;
        options.quiet = true;
        options.report = false;
        options.look_again = look;
        run_training(device, t.dataset, t.options, options, nullptr, t.photos);
        return read_checkpoint(options.output / "checkpoint.darb").state.model.position;
    };
    const auto without = run("without", false);
    EXPECT_FALSE(read_tuning(device.info(), device.cache_folder())->seen_in_a_run);
    EXPECT_EQ(run("with", true), without);
    const auto seen = read_tuning(device.info(), device.cache_folder());
    ASSERT_TRUE(seen);
    EXPECT_TRUE(seen->seen_in_a_run);
    EXPECT_EQ(seen->choice.at("loss"), fast) << measured[0].ms << " and " << measured[1].ms;
    fs::remove_all(folder);
}

TEST(TuningWalk, a_run_goes_on_in_the_way_that_it_began) {
    TinyTraining t = tiny_training();
    t.options.iterations = 14;
    const auto folder = [](const char* name) {
        return fs::path(testing::TempDir()) / fmt::format("darb_ways_{}_{}", ::getpid(), name);
    };
    const auto run = [&](const fs::path& output, const fs::path& resume) {
        RunOptions options;
        options.output = output;
        options.resume_from = resume;
        options.checkpoint_iterations = {7};
        options.quiet = true;
        options.report = false;
        run_training(shared_device(), t.dataset, t.options, options, nullptr, t.photos);
        return read_checkpoint(output / "checkpoint.darb");
    };
    Checkpoint whole;
    {
        const ScopedVariants variants(shared_device(), "backward=buckets");
        whole = run(folder("whole"), {});
    }
    EXPECT_EQ(whole.tuning, "backward=buckets");
    const ScopedVariants variants(shared_device(), "backward=subgroup");
    const Checkpoint other = run(folder("other"), {});
    const Checkpoint resumed = run(folder("resumed"), folder("whole") / "chkpnt7.darb");
    EXPECT_EQ(resumed.tuning, "backward=buckets");
    EXPECT_EQ(resumed.state.model.position, whole.state.model.position);
    EXPECT_EQ(resumed.state.moments, whole.state.moments);
    EXPECT_EQ(other.tuning, "backward=subgroup");
    EXPECT_NE(other.state.moments, whole.state.moments) << "both ways summed in one order";
    for (const char* name : {"whole", "other", "resumed"}) fs::remove_all(folder(name));
}

}  // namespace
}  // namespace darb::test
