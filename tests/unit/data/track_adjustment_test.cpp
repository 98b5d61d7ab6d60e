// SPDX-License-Identifier: MIT
// Bundle adjustment: cameras and points that tracks determine come back; those that fit stay.
#include "engine/data/track_adjustment.h"

#include <gtest/gtest.h>

#include "tests/support/tracked_dataset.h"

namespace darb::test {
namespace {

TEST(TrackAdjustment, cameras_and_points_come_back) {
    for (const double px : {1.0, 5.0}) {
        const Dataset truth = tracked_dataset();
        const auto places = places_of(truth);
        Dataset dataset = truth;
        disturb(dataset.views, places, px);
        Pcg32 rng(3);
        for (double& x : dataset.points.position) x += 0.01 * px * rng.normal();
        const TrackAdjustment result = adjust_to_tracks(dataset);
        ASSERT_TRUE(result.adjusted) << px;
        EXPECT_EQ(result.views, truth.views.size());
        EXPECT_EQ(result.points, truth.points.size());
        EXPECT_GT(result.before_px, 0.5 * px);
        EXPECT_LT(result.after_px, 0.01);
        EXPECT_NEAR(result.median_move_px, px, 0.8 * px);
        // Up to moves of the scene as a whole: as seen from one camera, the others are where the
        // tracks say.
        for (const TrackObservation& o : track_observations(dataset)) {
            const double* x = &dataset.points.position[3 * size_t{o.point}];
            const glm::dvec2 at = pinhole_pixel(dataset.views[o.view].camera, {x[0], x[1], x[2]});
            ASSERT_LT(glm::distance(at, o.at_px), 0.05);
        }
    }
}

// Tracks of a reconstruction have errors; cameras at their optimum do not improve.
TEST(TrackAdjustment, cameras_that_fit_stay_to_the_bit) {
    Dataset dataset = tracked_dataset();
    Pcg32 rng(4);
    for (size_t k = 0; k < dataset.points.seen_at.size(); ++k)
        dataset.points.seen_at[k] += static_cast<float>(0.3 / 200 * rng.normal());
    const Dataset before = dataset;
    const TrackAdjustment result = adjust_to_tracks(dataset);
    EXPECT_FALSE(result.adjusted);
    EXPECT_GT(result.before_px, 0.1);
    EXPECT_EQ(dataset.points.position, before.points.position);
    for (size_t v = 0; v < dataset.views.size(); ++v)
        EXPECT_EQ(dataset.views[v].camera.translation, before.views[v].camera.translation);
}

TEST(TrackAdjustment, a_wild_observation_pulls_no_camera) {
    Dataset dataset = tracked_dataset();
    const auto places = places_of(dataset);
    const Dataset truth = dataset;
    disturb(dataset.views, places, 2);
    for (size_t k = 0; k < dataset.points.seen_at.size(); k += 40) dataset.points.seen_at[k] = 0.9f;
    ASSERT_TRUE(adjust_to_tracks(dataset).adjusted);
    EXPECT_LT(median_track_error_px(dataset, track_observations(truth)), 0.1);
}

TEST(TrackAdjustment, without_tracks_nothing_happens) {
    Dataset dataset = tracked_dataset();
    dataset.points.seen_at.clear();
    const TrackAdjustment result = adjust_to_tracks(dataset);
    EXPECT_FALSE(result.adjusted);
    EXPECT_EQ(result.observations, 0u);
}

}  // namespace
}  // namespace darb::test
