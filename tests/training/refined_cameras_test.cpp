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

// Twelve photos, whose rows are exposed while the cameras turn, where `fast` is not 0. The splats
// are those of the scene and stay.
struct RollingTraining : TinyTraining {
    SplatModel scene;

    explicit RollingTraining(double fast) : TinyTraining(tiny_training({.views = 12})) {
        const DisturbedTraining usual(0);
        scene = usual.scene;
        options = usual.options;
        options.probe_shutter = true;
        ForwardOptions pictures;
        pictures.effects.shutter = pictures.effects.off_centre = true;
        pictures.kernel = scene.kernel;
        Renderer renderer(shared_device(), scene, pictures);
        Pcg32 rng(7);
        for (size_t v = 0; v < photos.size(); ++v) {
            Camera camera = dataset.views[v].camera;
            camera.shutter.active = true;
            for (int k = 0; k < 3; ++k) camera.shutter.turn[k] = fast * rng.normal();
            photos[v] = with_alpha(to_8bit(renderer.render(camera)));
        }
        for (View& view : dataset.views) view.is_test = false;
    }
};

TEST(RefinedCameras, rows_that_roll_are_admitted_by_photos_set_aside) {
    const RollingTraining t(0.08);
    const int at = ShutterProbe::at(t.options);
    Trainer trainer(shared_device(), t.dataset, t.photos, t.scene, t.options);
    run_and_drain(trainer, at);
    EXPECT_FALSE(trainer.effects().shutter);
    const Trainer::State before = trainer.state();
    run_and_drain(trainer, at + 12);
    ASSERT_EQ(trainer.probes().size(), 1u);
    EXPECT_TRUE(trainer.probes()[0].admitted) << trainer.probes()[0].gain_db;
    EXPECT_EQ(trainer.probes()[0].iteration, at);
    EXPECT_TRUE(trainer.effects().shutter);
    EXPECT_GT(trainer.camera_moves()->median_rolled_px, 0.3);

    // It goes on from before the probe and from after it.
    for (const Trainer::State& from : {before, trainer.state()}) {
        Trainer again(shared_device(), t.dataset, t.photos, t.scene, t.options);
        again.restore(from);
        EXPECT_EQ(again.effects().shutter, from.iteration > at);
        run_and_drain(again, at + 24);
        if (trainer.iteration() < at + 24) run_and_drain(trainer, at + 24);
        EXPECT_TRUE(same_state(trainer, again)) << "from " << from.iteration;
    }
}

TEST(RefinedCameras, rows_that_do_not_roll_are_refused_without_a_trace) {
    RollingTraining t(0);
    const int at = ShutterProbe::at(t.options);
    Trainer probed(shared_device(), t.dataset, t.photos, t.scene, t.options);
    run_and_drain(probed, at + 12);
    ASSERT_EQ(probed.probes().size(), 1u);
    EXPECT_FALSE(probed.probes()[0].admitted) << probed.probes()[0].gain_db;
    EXPECT_FALSE(probed.effects().shutter);
    t.options.probe_shutter = false;
    Trainer plain(shared_device(), t.dataset, t.photos, t.scene, t.options);
    run_and_drain(plain, at + 12);
    EXPECT_TRUE(same_state(probed, plain));
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
