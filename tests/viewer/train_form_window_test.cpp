// SPDX-License-Identifier: MIT
// Training from an empty window under Xvfb, as a hand does it: the form, a wrong number and its
// mending, the forecast, the run, and the scene that it leaves.
#include <gtest/gtest.h>

#include "tests/support/window_fixture.h"
#include "tests/support/x_drop.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

class TrainFormWindowTest : public DisplayTest {
  protected:
    void start() {
        program_.emplace(Words{DARB_COMMAND, "view", "--size", "800x600"}, folder_ / "view.log");
        ASSERT_TRUE(eventually([&] { return settled().at(600, 300, 0) < 100; })) << "no window";
    }
    // Types over what the field has. y: of its middle, px
    void type(int y, const std::string& text) {
        xdo({"mousemove", "420", std::to_string(y), "click", "1"});
        settled();
        xdo({"keydown", "ctrl", "keydown", "a", "sleep", "0.3", "keyup", "a", "keyup", "ctrl"});
        xdo({"type", "--delay", "5", text});
        settled();
    }
    // Red words: they stand in the form alone.
    bool complains() const {
        const ImageU8 now = screen();
        for (int y = 60; y < 560; ++y)
            for (int x = 250; x < 700; ++x)
                if (now.at(x, y, 0) > 200 && now.at(x, y, 1) < 165 && now.at(x, y, 2) < 165)
                    return true;
        return false;
    }
    static constexpr int kPhotos = 93, kOutput = 122, kLength = 151, kIterations = 180;
};

TEST_F(TrainFormWindowTest, A_run_is_begun_watched_and_opened_slow) {
    start();
    const ImageU8 empty = settled();
    const fs::path out = folder_ / "run";
    xdo({"mousemove", "250", "560", "key", "ctrl+t"});
    ASSERT_TRUE(changes_from(empty, 50)) << "no form";
    settled();
    type(kPhotos, DARB_SOURCE_DIR "/assets/scene");
    type(kOutput, out.string());
    type(kLength, "preview");
    type(kIterations, "many");
    EXPECT_TRUE(eventually([&] { return complains(); })) << "a wrong number is taken";
    type(kIterations, "60");
    EXPECT_TRUE(eventually([&] { return !complains(); })) << "still red";
    settled();  // the forecast is there
    xdo({"mousemove", "140", "562", "click", "1"});
    EXPECT_TRUE(eventually([&] { return fs::exists(out / "metrics.json"); })) << log("view.log");
    EXPECT_TRUE(eventually([&] { return log("view.log").find("loaded") != std::string::npos; }))
        << log("view.log");
    EXPECT_TRUE(fs::exists(out / "point_cloud" / "iteration_60" / "point_cloud.ply"));
    xdo({"key", "ctrl+q"});
    ASSERT_TRUE(eventually([&] { return !program_->running(); }));
    EXPECT_EQ(program_->wait(), 0) << log("view.log");
}

TEST_F(TrainFormWindowTest, A_window_that_closes_asks_first_and_its_run_saves_itself_slow) {
    start();
    const fs::path out = folder_ / "run";
    const ImageU8 empty = settled();
    ASSERT_TRUE(drop_on_window("darb", DARB_SOURCE_DIR "/assets/scene"));  // fills in the photos
    ASSERT_TRUE(changes_from(empty, 50)) << "no form";
    settled();
    type(kOutput, out.string());
    settled();
    xdo({"mousemove", "140", "562", "click", "1"});
    EXPECT_TRUE(eventually([&] { return fs::exists(out / "run.jsonl"); })) << log("view.log");
    ASSERT_TRUE(changes_from(screen(), 5)) << "no run";
    xdo({"mousemove", "250", "560", "key", "ctrl+q"});
    std::this_thread::sleep_for(std::chrono::seconds(2));
    EXPECT_TRUE(program_->running()) << "it did not ask";
    program_->terminate();
    ASSERT_TRUE(eventually([&] { return !program_->running(); }));
    EXPECT_TRUE(fs::exists(out / "checkpoint.darb")) << log("view.log");
}

}  // namespace
}  // namespace darb::test
