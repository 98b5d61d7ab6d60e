// SPDX-License-Identifier: MIT
// Refined cameras without a picture: the effect of the anchor of tracks alone.
#include "trainer/step/camera_refinement.h"

#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "tests/support/tracked_dataset.h"

namespace darb::test {
namespace {

TrainOptions refining(int iterations) {
    TrainOptions o;
    o.iterations = iterations;
    o.refine_cameras = true;
    o.camera_from = 0;
    o.camera_lr = 0.3f;
    return o;
}

void visit_all(CameraRefinement& cameras, const Dataset& dataset, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        const int view = i % static_cast<int>(dataset.views.size());
        if (dataset.views[size_t(view)].is_test) continue;
        const CameraVisit visit{view, {}, 200, 150};
        cameras.step(i + 1, {&visit, 1});
    }
}

// With the points where they are, poses come back, and so does a wrong focal length.
TEST(CameraRefinement, tracks_bring_disturbed_cameras_back) {
    const Dataset truth = tracked_dataset();
    const auto places = places_of(truth);
    Dataset dataset = truth;
    disturb(dataset.views, places, 2);
    CameraRefinement cameras(dataset, refining(1'600));
    const CameraMoves none = cameras.moves();
    EXPECT_EQ(none.largest_px, 0);
    visit_all(cameras, dataset, 0, 1'600);
    std::vector<double> shifts;
    for (size_t v = 0; v < truth.views.size(); ++v)
        shifts.push_back(
            shift_px(cameras.camera(static_cast<int>(v)), truth.views[v].camera, places));
    for (const double shift : shifts) EXPECT_LT(shift, 0.1);
    EXPECT_GT(cameras.moves().median_px, 0.5);
    EXPECT_EQ(cameras.moves().cameras, truth.views.size());
}

/// The same points seen by cameras that move while rows are exposed; the data set does not say how.
std::vector<Camera> let_shutters_roll(Dataset& dataset) {
    Pcg32 rng(3);
    std::vector<Camera> truth;
    for (View& view : dataset.views) {
        Camera& c = view.camera;
        c.shutter.active = true;
        truth.push_back(c);
        ShutterTerms& rolls = truth.back().shutter;
        for (int k = 0; k < 3; ++k)
            rolls.turn[k] = rng.uniform(-0.02, 0.02), rolls.move[k] = rng.uniform(-0.05, 0.05);
    }
    const auto places = places_of(dataset);
    for (size_t p = 0; p < places.size(); ++p)
        for (size_t k = dataset.points.seen_begin[p]; k < dataset.points.seen_begin[p + 1]; ++k) {
            const Camera& c = truth[dataset.points.seen_by[k]];
            glm::dvec2 at(0.0, 0.5 * c.height);
            for (int step = 0; step < 8; ++step)
                at = pinhole_pixel(camera_at_row(c, at.y / c.height - 0.5), places[p]);
            dataset.points.seen_at[2 * k] = static_cast<float>(at.x / c.width);
            dataset.points.seen_at[2 * k + 1] = static_cast<float>(at.y / c.height);
        }
    return truth;
}

TEST(CameraRefinement, tracks_tell_how_cameras_moved_while_their_rows_were_exposed) {
    Dataset dataset = tracked_dataset();
    const std::vector<Camera> truth = let_shutters_roll(dataset);
    const auto places = places_of(dataset);
    const auto apart = [&](const Camera& a, const Camera& b) {
        return std::max(shift_px(camera_at_row(a, -0.5), camera_at_row(b, -0.5), places),
                        shift_px(camera_at_row(a, 0.5), camera_at_row(b, 0.5), places));
    };
    TrainOptions options = refining(1'600);
    options.projection.shutter = true;
    CameraRefinement cameras(dataset, options);
    for (size_t v = 0; v < truth.size(); ++v)
        EXPECT_GT(apart(dataset.views[v].camera, truth[v]), 0.4);
    visit_all(cameras, dataset, 0, 1'600);
    for (size_t v = 0; v < truth.size(); ++v)
        EXPECT_LT(apart(cameras.camera(static_cast<int>(v)), truth[v]), 0.2);
    EXPECT_GT(cameras.moves().median_rolled_px, 1);

    CameraRefinement again(dataset, options);
    again.restore(cameras.state());
    for (size_t v = 0; v < truth.size(); ++v)
        EXPECT_EQ(again.camera(static_cast<int>(v)).shutter.turn,
                  cameras.camera(static_cast<int>(v)).shutter.turn);
}

TEST(CameraRefinement, cameras_that_are_right_stay) {
    const Dataset truth = tracked_dataset();
    CameraRefinement cameras(truth, refining(400));
    visit_all(cameras, truth, 0, 400);
    EXPECT_LT(cameras.moves().largest_px, 0.1);
    EXPECT_LT(cameras.moves().largest_focal, 1e-3);
}

TEST(CameraRefinement, a_wrong_focal_length_comes_back_and_held_out_views_share_it) {
    const Dataset truth = tracked_dataset();
    Dataset dataset = truth;
    for (View& view : dataset.views) view.camera.fx *= 1.02, view.camera.fy *= 1.02;
    // What photos saw is where it was.
    for (View& view : dataset.views) view.lens.parameters = {224.4, 224.4, 100, 75};
    dataset.views[0].is_test = true;
    CameraRefinement cameras(dataset, refining(4'000));
    visit_all(cameras, dataset, 0, 4'000);
    EXPECT_NEAR(cameras.camera(1).fx, 220, 2);
    EXPECT_EQ(cameras.camera(0).fx, cameras.camera(1).fx);
    EXPECT_EQ(cameras.camera(0).translation, dataset.views[0].camera.translation);
}

TEST(CameraRefinement, goes_on_from_its_state_with_the_same_bits) {
    Dataset dataset = tracked_dataset();
    disturb(dataset.views, places_of(dataset), 2);
    CameraRefinement whole(dataset, refining(200)), first(dataset, refining(200)),
        second(dataset, refining(200));
    visit_all(whole, dataset, 0, 200);
    visit_all(first, dataset, 0, 90);
    second.restore(first.state());
    visit_all(second, dataset, 90, 200);
    EXPECT_EQ(second.state(), whole.state());
    for (int v = 0; v < 8; ++v)
        EXPECT_EQ(second.camera(v).translation, whole.camera(v).translation);
    EXPECT_THROW(second.restore({1, 2, 3}), Error);
}

TEST(CameraRefinement, shutters_begin_still_where_a_run_tries_them) {
    Dataset dataset = tracked_dataset();
    const std::vector<Camera> truth = let_shutters_roll(dataset);
    for (View& view : dataset.views) view.camera.shutter = {};
    TrainOptions options = refining(200);
    options.probe_shutter = true;
    CameraRefinement tries(dataset, options);
    visit_all(tries, dataset, 0, 90);
    EXPECT_FALSE(tries.shutters());
    const std::vector<float> still = tries.state();
    const Camera before = tries.camera(1);
    tries.restore(tries.with_shutters(still));
    EXPECT_TRUE(tries.shutters());
    EXPECT_TRUE(tries.camera(1).shutter.active);
    EXPECT_EQ(tries.camera(1).shutter.turn, glm::dvec3(0.0));
    EXPECT_EQ(tries.camera(1).translation, before.translation);
    EXPECT_EQ(tries.camera(1).fx, before.fx);
    visit_all(tries, dataset, 90, 200);
    EXPECT_GT(tries.moves().largest_rolled_px, 0.1);
    const std::vector<float> rolled = tries.state();
    tries.restore(still);
    EXPECT_FALSE(tries.shutters());
    EXPECT_FALSE(tries.camera(1).shutter.active);
    EXPECT_EQ(tries.state(), still);
    CameraRefinement plain(dataset, refining(200));
    EXPECT_THROW(plain.restore(rolled), Error) << "a run that does not try them has none";
}

TEST(CameraRefinement, two_photos_are_too_few) {
    EXPECT_THROW(CameraRefinement(tracked_dataset(2), refining(100)), Error);
}

TEST(CameraRefinement, a_gradient_that_is_no_number_moves_nothing) {
    const Dataset dataset = tracked_dataset();
    CameraRefinement cameras(dataset, refining(100));
    CameraVisit visit{1, {}, 200, 150};
    visit.gradient.d_translation.x = std::nan("");
    cameras.step(50, {&visit, 1});
    EXPECT_EQ(cameras.camera(1).translation, dataset.views[1].camera.translation);
}

}  // namespace
}  // namespace darb::test
