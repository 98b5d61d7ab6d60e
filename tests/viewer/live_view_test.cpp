// SPDX-License-Identifier: MIT
// darb train --view under Xvfb: pause, single steps, and a window that is closed while the run goes
// on.
#include <gtest/gtest.h>

#include "tests/support/window_fixture.h"

namespace darb::test {
namespace {

using LiveViewTest = DisplayTest;

TEST_F(LiveViewTest, Run_pauses_steps_and_goes_on_when_the_window_is_closed_slow) {
    const std::filesystem::path out = folder_ / "run";
    program_.emplace(
        Words{DARB_COMMAND, "train", DARB_SOURCE_DIR "/assets/scene", "-o", out.string(),
              "--iterations", "200", "-r", "8", "--effects", "none", "--view"},
        folder_ / "train.log");
    const ImageU8 empty(kDisplayWidth, kDisplayHeight, 3);
    ASSERT_TRUE(changes_from(empty, 100)) << log("train.log");
    xdo({"search", "--name", "darb", "windowsize", "800", "600"});  // with the panels in sight
    settled();
    xdo({"mousemove", "250", "400", "key", "space"});
    ImageU8 paused = settled();
    int same = 0;  // a run that compiles shows nothing new for a while either
    EXPECT_TRUE(eventually([&] {
        const ImageU8 now = settled();
        same = largest_difference(now, paused) == 0 ? same + 1 : 0;
        paused = now;
        return same >= 3;
    })) << "pause";
    xdo({"key", "period"});
    EXPECT_TRUE(changes_from(paused, 20)) << "step";
    const ImageU8 stepped = settled();
    EXPECT_TRUE(program_->running());
    xdo({"key", "space"});
    EXPECT_TRUE(changes_from(stepped, 20)) << "go on";
    xdo({"key", "ctrl+q"});
    EXPECT_TRUE(shows(empty)) << "the window is still there";
    EXPECT_TRUE(eventually([&] { return !program_->running(); }));
    EXPECT_EQ(program_->wait(), 0) << log("train.log");
    EXPECT_TRUE(std::filesystem::exists(out / "point_cloud" / "iteration_200" / "point_cloud.ply"))
        << log("train.log");
}

TEST_F(LiveViewTest, Run_goes_on_when_the_display_is_gone_slow) {
    const std::filesystem::path out = folder_ / "run";
    program_.emplace(
        Words{DARB_COMMAND, "train", DARB_SOURCE_DIR "/assets/scene", "-o", out.string(),
              "--iterations", "200", "-r", "8", "--effects", "none", "--view"},
        folder_ / "train.log");
    ASSERT_TRUE(changes_from(ImageU8(kDisplayWidth, kDisplayHeight, 3), 100)) << log("train.log");
    xdo({"mousemove", "600", "400", "key", "space"});  // a pause, which ends with the display
    settled();
    display_->terminate();
    display_->wait();
    EXPECT_TRUE(eventually([&] { return !program_->running(); })) << log("train.log");
    EXPECT_EQ(program_->wait(), 0) << log("train.log");
    EXPECT_TRUE(std::filesystem::exists(out / "point_cloud" / "iteration_200" / "point_cloud.ply"))
        << log("train.log");
    EXPECT_NE(log("train.log").find("the display is gone; the run goes on"), std::string::npos)
        << log("train.log");
}

}  // namespace
}  // namespace darb::test
