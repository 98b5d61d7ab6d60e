// SPDX-License-Identifier: MIT
// Which picture a frame draws: in motion, at rest, before a long one, and while other work draws.
#include "viewer/picture_pacing.h"

#include <gtest/gtest.h>

#include <cmath>

namespace darb {
namespace {

class PicturePacingTest : public ::testing::Test {
  protected:
    // The step of a frame so many seconds after the start, drawn where there is something to draw.
    PictureStep frame(double seconds, const PicturePacing::Frame& with = {}) {
        now_ = start_ + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                            std::chrono::duration<double>(seconds));
        const PictureStep step = pacing_.next(key_, with, now_);
        if (step == PictureStep::in_motion)
            pacing_.drew(step, {0.5, 0.5});
        else if (step == PictureStep::preview)
            pacing_.drew(step, {1, 0.5});
        else if (step == PictureStep::whole)
            pacing_.drew(step, {});
        return step;
    }
    void move() { key_.camera.cx += 1; }

    PicturePacing pacing_;
    PictureKey key_;
    PicturePacing::Time start_ = std::chrono::steady_clock::now(), now_ = start_;
};

TEST_F(PicturePacingTest, The_first_picture_is_whole_and_then_nothing_is_drawn) {
    EXPECT_EQ(frame(0), PictureStep::whole);
    EXPECT_TRUE(pacing_.is_whole());
    EXPECT_EQ(frame(0.01), PictureStep::none);
    EXPECT_EQ(frame(10), PictureStep::none);
    EXPECT_TRUE(std::isinf(pacing_.seconds_to_refine(now_)));
}

TEST_F(PicturePacingTest, Motion_is_coarse_and_rest_is_whole) {
    frame(0);
    move();
    EXPECT_EQ(frame(1), PictureStep::in_motion);
    EXPECT_TRUE(pacing_.in_motion());
    EXPECT_FALSE(pacing_.refined());
    EXPECT_NEAR(pacing_.seconds_to_refine(now_), 0.12, 1e-6);
    EXPECT_EQ(frame(1.05), PictureStep::none);  // it stands still: nothing better is due yet
    EXPECT_NEAR(pacing_.seconds_to_refine(now_), 0.07, 1e-6);
    EXPECT_EQ(frame(1.13), PictureStep::whole);
    EXPECT_TRUE(pacing_.refined() && pacing_.is_whole());
}

// It is known only after some frames that a picture had no room.
TEST_F(PicturePacingTest, What_was_missed_is_drawn_again_as_it_would_be) {
    frame(0);
    move();
    frame(1);
    pacing_.miss();
    EXPECT_EQ(frame(1.05), PictureStep::in_motion) << "not whole, as it moves";
    EXPECT_EQ(frame(1.06), PictureStep::none);
    EXPECT_EQ(frame(1.2), PictureStep::whole);
    pacing_.miss();
    EXPECT_FALSE(pacing_.refined() || pacing_.is_whole());
    EXPECT_EQ(frame(1.3), PictureStep::whole);
    EXPECT_TRUE(pacing_.is_whole());
}

TEST_F(PicturePacingTest, A_long_picture_comes_in_two_steps) {
    PicturePacing::Frame slow;
    slow.preview_pays = true;
    frame(0);
    move();
    EXPECT_EQ(frame(1, slow), PictureStep::in_motion);
    EXPECT_EQ(frame(1.2, slow), PictureStep::preview);
    EXPECT_TRUE(pacing_.refined());
    EXPECT_FALSE(pacing_.is_whole());
    EXPECT_EQ(frame(1.21, slow), PictureStep::whole);
}

TEST_F(PicturePacingTest, Whole_at_once_leaves_out_the_lesser_ones) {
    PicturePacing::Frame full;
    full.whole_at_once = full.preview_pays = full.may_rehearse = true;
    frame(0);
    move();
    EXPECT_EQ(frame(1, full), PictureStep::whole);
    EXPECT_EQ(frame(2, full), PictureStep::none);
}

TEST_F(PicturePacingTest, An_edit_or_a_training_step_is_no_motion) {
    frame(0);
    ++key_.version;
    EXPECT_EQ(frame(1), PictureStep::whole);
}

TEST_F(PicturePacingTest, Work_draws_alone_and_the_scene_comes_back_after_it) {
    PicturePacing::Frame works;
    works.works = true;
    frame(0);
    move();
    pacing_.forget();
    EXPECT_EQ(frame(1, works), PictureStep::none);
    EXPECT_FALSE(pacing_.refined());
    EXPECT_EQ(frame(1.01), PictureStep::whole);
}

TEST_F(PicturePacingTest, A_picture_that_failed_is_tried_again_after_a_change_alone) {
    EXPECT_EQ(pacing_.next(key_, {}, start_), PictureStep::whole);
    pacing_.drew(PictureStep::whole, {});
    pacing_.failed();
    EXPECT_EQ(frame(1), PictureStep::none);
    move();
    EXPECT_EQ(frame(2), PictureStep::in_motion);
}

TEST_F(PicturePacingTest, Motion_is_rehearsed_only_where_the_whole_picture_is_there) {
    PicturePacing::Frame unprepared;
    unprepared.may_rehearse = true;
    EXPECT_EQ(frame(0, unprepared), PictureStep::whole);
    EXPECT_EQ(frame(0.01, unprepared), PictureStep::rehearsal);
    move();
    EXPECT_EQ(frame(1, unprepared), PictureStep::in_motion);
}

// They show its times in the next frame, and have their size in the one after.
TEST_F(PicturePacingTest, The_panels_get_two_frames_after_a_whole_picture) {
    frame(0);
    EXPECT_EQ(pacing_.count_still_frame(), 0);
    frame(0.01);
    EXPECT_EQ(pacing_.count_still_frame(), 0);
    EXPECT_FALSE(pacing_.settled());
    frame(0.02);
    EXPECT_TRUE(std::isinf(pacing_.count_still_frame()));
    EXPECT_TRUE(pacing_.settled());
}

}  // namespace
}  // namespace darb
