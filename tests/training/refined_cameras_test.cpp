// SPDX-License-Identifier: MIT
// Cameras trained beside the splats: by pictures alone, held by nothing but them.
#include <algorithm>

#include "engine/core/quantile.h"
#include "tests/support/resumed_run.h"
#include "tests/support/tracked_dataset.h"
#include "trainer/step/camera_refinement.h"

namespace darb::test {
namespace {

// The scene that photos were taken of, and cameras that are `px` off.
struct DisturbedTraining : TinyTraining {
    std::vector<View> truth;
    SplatModel scene;

    explicit DisturbedTraining(double px) : TinyTraining(tiny_training()) {
        scene = random_scene({.count = 60,
                              .width = 64,
                              .height = 48,
                              .sh_degree = 0,
                              .min_log_scale = -2.5,
                              .max_log_scale = -1.5,
                              .seed = 91})
                    .model;
        truth = dataset.views;
        if (px > 0) disturb_views(px);
        options.refine_cameras = true;
        options.camera_from = 0;
        options.camera_lr = 0.6f;
        options.iterations = 80;
        // The splats are those of the scene, and stay: few views of few pixels hold nothing else.
        options.position_lr_init = options.position_lr_final = 1e-12f;
        options.scale_lr = options.rotation_lr = options.opacity_lr = 1e-12f;
        options.sh_dc_lr = 1e-12f;
        options.opacity_weight = options.scale_weight = 0;
        options.clearance = 0;
        options.kernel = KERNEL_GAUSSIAN;
        options.sh_degree = 0;
        options.densify_until = 1;
        options.resolution_ramp = false;
        options.average_from = 1;
    }

    // Those that are trained on among themselves, as what moves them all alike cannot come back.
    void disturb_views(double px) {
        std::vector<View> trained;
        for (const View& view : truth)
            if (!view.is_test) trained.push_back(view);
        disturb(trained, places_of(dataset), px);
        disturb(dataset.views, places_of(dataset), px);
        for (View& view : dataset.views)
            for (const View& one : trained)
                if (one.name == view.name) view.camera = one.camera;
    }

    double median_px(const Trainer& trainer) const {
        std::vector<double> all;
        for (size_t v = 0; v < truth.size(); ++v)
            if (!truth[v].is_test)
                all.push_back(shift_px(trainer.camera(v), truth[v].camera, places_of(dataset)));
        return nearest_rank(all, 0.5);
    }
};

TEST(RefinedCameras, come_back_by_pictures_alone) {
    const DisturbedTraining t(2);
    Trainer trainer(shared_device(), t.dataset, t.photos, t.scene, t.options);
    const double before = t.median_px(trainer);
    run_to(trainer, t.options.iterations);
    trainer.drain();
    EXPECT_GT(before, 1.5);
    EXPECT_LT(t.median_px(trainer), 0.3);
    ASSERT_TRUE(trainer.camera_moves().has_value());
    EXPECT_GT(trainer.camera_moves()->median_px, 1);
}

TEST(RefinedCameras, that_are_right_stay_long) {
    const DisturbedTraining t(0);
    Trainer trainer(shared_device(), t.dataset, t.photos, t.scene, t.options);
    run_to(trainer, t.options.iterations);
    EXPECT_LT(t.median_px(trainer), 0.2);
}

TEST(RefinedCameras, one_that_is_held_out_fits_its_photo_while_the_scene_stays) {
    const DisturbedTraining t(2);
    CameraAlignment alignment(shared_device(), t.scene);
    const Camera aligned =
        alignment.align(t.dataset.views[0].camera, t.photos[0], glm::vec3(0.0f), false);
    const auto places = places_of(t.dataset);
    EXPECT_GT(shift_px(t.dataset.views[0].camera, t.truth[0].camera, places), 0.5);
    EXPECT_LT(shift_px(aligned, t.truth[0].camera, places), 0.1);
}

// Through density control, probes and smaller photos.
void check_resume(int batch, int stop, int end) {
    TinyTraining t = tiny_training();
    disturb(t.dataset.views, places_of(t.dataset), 1);
    t.options.refine_cameras = true;
    t.options.camera_from = 0.1f;
    t.options.batch = batch;
    t.options.antialias = true;
    Trainer whole = t.trainer(), again = t.trainer();
    run_to(whole, end);
    run_to(again, end);
    EXPECT_TRUE(same_state(whole, again)) << "repeats bit by bit";
    EXPECT_GT(whole.camera_moves()->largest_px, 0);
    expect_resumes(t, whole, {stop});
}

TEST(RefinedCameras, go_on_from_a_checkpoint_with_the_same_bits_slow) {
    check_resume(1, 8, 16);
}

TEST(RefinedCameras, go_on_in_batches_with_the_same_bits_long) {
    check_resume(2, 20, 40);
}

}  // namespace
}  // namespace darb::test
