// SPDX-License-Identifier: MIT
// Effects in training: probes for view-dependent colour, exposure, anti-aliasing, and runs that go
// on bit by bit with all of them.
#include "engine/plan/effect_plan.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/resumed_run.h"
#include "tests/support/same_rounding.h"
#include "tests/support/test_device_options.h"
#include "tests/support/tiny_training.h"
#include "trainer/run/run.h"

namespace darb::test {
namespace {

struct ProbeCase : TinyTraining {
    SplatModel truth;  // what the photos show
    Trainer from_truth() const { return Trainer(shared_device(), dataset, photos, truth, options); }
};

/// Twelve small photos of splats whose colours change with the view by `rest`.
ProbeCase training_of(float rest) {
    ProbeCase t{tiny_training({.views = 12, .width = 48, .height = 36, .splats = 40}), {}};
    TestScene truth = random_scene({.count = 40,
                                    .width = 48,
                                    .height = 36,
                                    .sh_degree = 1,
                                    .min_log_scale = -2.5,
                                    .max_log_scale = -1.5,
                                    .seed = 91});
    for (float& c : truth.model.sh_rest) c = (c > 0 ? rest : -rest);
    Renderer renderer(shared_device(), truth.model);
    for (size_t v = 0; v < t.photos.size(); ++v)
        t.photos[v] = with_alpha(to_8bit(renderer.render(t.dataset.views[v].camera)));
    t.truth = truth.model;
    for (View& view : t.dataset.views) view.is_test = false;
    t.options.kernel = KERNEL_GAUSSIAN;
    t.options.iterations = 400;
    t.options.densify_until = 0;
    t.options.sh_degree = 1;
    t.options.sh_interval = 150;
    t.options.probe_sh = true;
    return t;
}

TEST(SphericalHarmonicsProbe, a_matte_scene_stays_at_degree_0_without_buffers_for_more) {
    const ProbeCase t = training_of(0.0f);
    Trainer trainer = t.from_truth();
    for (int i = 0; i < 200; ++i) trainer.step();
    ASSERT_EQ(trainer.probes().size(), 1u);
    EXPECT_FALSE(trainer.probes()[0].admitted) << trainer.probes()[0].gain_db;
    EXPECT_EQ(trainer.sh_degree(), 0);
    EXPECT_EQ(trainer.iteration(), 200);
    const SplatModel model = trainer.model();
    EXPECT_EQ(model.sh_degree, 0);
    EXPECT_TRUE(model.sh_rest.empty());
}

TEST(SphericalHarmonicsProbe, colours_that_change_with_the_view_admit_a_degree) {
    const ProbeCase t = training_of(0.25f);
    Trainer trainer = t.trainer();
    for (int i = 0; i < 200; ++i) trainer.step();
    ASSERT_EQ(trainer.probes().size(), 1u);
    EXPECT_TRUE(trainer.probes()[0].admitted) << trainer.probes()[0].gain_db;
    const SplatModel model = trainer.model();
    EXPECT_EQ(model.sh_degree, 1);
    double largest = 0;
    for (const float c : model.sh_rest) largest = std::max(largest, double{std::abs(c)});
    EXPECT_GT(largest, 1e-3) << "the bands are meant to be trained after they were admitted";
}

TEST(SphericalHarmonicsProbe, the_degrees_above_the_first_follow_it) {
    ProbeCase t = training_of(0.25f);
    t.options.sh_degree = 3;
    t.options.sh_interval = 50;
    Trainer trainer = t.trainer();
    for (int i = 0; i < 160; ++i) trainer.step();
    ASSERT_EQ(trainer.probes().size(), 3u);
    EXPECT_GT(trainer.probes()[0].gain_db, 0.05);
    for (int i = 1; i < 3; ++i) {
        EXPECT_TRUE(trainer.probes()[i].admitted);
        EXPECT_EQ(trainer.probes()[i].iteration, 50 * (i + 1));
        EXPECT_TRUE(std::isnan(trainer.probes()[i].gain_db)) << "nothing is measured";
    }
    EXPECT_EQ(trainer.sh_degree(), 3);
}

// Tiny memory: all that is there, and less than a degree more takes.
TEST(SphericalHarmonicsProbe, a_degree_without_room_is_refused_unmeasured) {
    ProbeCase t = training_of(0.25f);
    Device device{test::device_options()};
    Trainer roomy(device, t.dataset, t.photos, t.start(), t.options);
    for (int i = 0; i < 149; ++i) roomy.step();
    roomy.drain();
    t.options.max_memory_bytes = device.allocated_bytes() + 1024;
    Device narrow{test::device_options()};
    Tuning tuning = narrow.tuning();
    tuning.photos = PhotoPlace::resident;  // else they make room
    narrow.set_tuning(tuning);
    Trainer trainer(narrow, t.dataset, t.photos, t.start(), t.options);
    for (int i = 0; i < 200; ++i) trainer.step();
    ASSERT_EQ(trainer.probes().size(), 1u);
    EXPECT_FALSE(trainer.probes()[0].admitted);
    EXPECT_TRUE(std::isnan(trainer.probes()[0].gain_db));
    EXPECT_EQ(trainer.sh_degree(), 0);
}

TEST(SphericalHarmonicsProbe, a_refused_probe_leaves_no_trace) {
    ProbeCase t = training_of(0.0f);
    Trainer probed = t.from_truth();
    t.options.probe_sh = false;
    t.options.sh_degree = 0;
    t.truth.sh_degree = 0;
    t.truth.sh_rest.clear();
    Trainer plain = t.from_truth();
    for (int i = 0; i < 170; ++i) {
        probed.step();
        plain.step();
    }
    ASSERT_EQ(probed.probes().size(), 1u);
    ASSERT_FALSE(probed.probes()[0].admitted);
    EXPECT_TRUE(same_state(probed, plain));
}

TEST(ExposureTraining, finds_the_gains_of_the_photos) {
    ProbeCase t = training_of(0.0f);
    t.options.probe_sh = false;
    t.options.sh_degree = 0;
    t.options.exposure = true;
    t.options.exposure_lr_init = 0.01f;  // there in 400 steps
    t.options.exposure_lr_final = 0.001f;
    const auto gain_of = [](size_t v) { return v % 2 == 0 ? 0.8 : 1.1; };
    for (size_t v = 0; v < t.photos.size(); ++v)
        for (size_t i = 0; i < t.photos[v].data.size(); ++i)
            if (i % 4 != 3)
                t.photos[v].data[i] =
                    static_cast<std::uint8_t>(std::min(255.0, gain_of(v) * t.photos[v].data[i]));
    Trainer trainer = t.trainer();
    for (int i = 0; i < 400; ++i) trainer.step();
    const auto maps = trainer.exposures();
    ASSERT_EQ(maps.size(), t.photos.size());
    double sums[12] = {}, low = 0, high = 0;
    for (size_t v = 0; v < t.photos.size(); ++v) {
        const ColourMap& map = maps.at(t.dataset.views[v].name);
        for (size_t k = 0; k < 12; ++k) sums[k] += map[k] / double(maps.size());
        double grey = 0;  // what a middle grey becomes
        for (size_t r = 0; r < 3; ++r)
            grey += (0.4 * (map[r * 4] + map[r * 4 + 1] + map[r * 4 + 2]) + map[r * 4 + 3]) / 3;
        (v % 2 == 0 ? low : high) += grey / 6;
    }
    EXPECT_NEAR(high / low, 1.1 / 0.8, 0.12);
    for (size_t k = 0; k < 12; ++k)
        EXPECT_NEAR(sums[k], kIdentityColours[k], 1e-5) << "the mean of the maps, " << k;
}

// Six views each of two panoramas.
TEST(ExposureTraining, faces_of_a_panorama_share_one_map) {
    ProbeCase t = training_of(0.0f);
    t.options.probe_sh = false;
    t.options.sh_degree = 0;
    t.options.exposure = true;
    for (size_t v = 0; v < t.photos.size(); ++v) {
        t.dataset.views[v].face = static_cast<int>(v % 6);
        t.dataset.views[v].photo = v < 6 ? "first.jpg" : "second.jpg";
    }
    Trainer trainer = t.trainer();
    run_and_drain(trainer, 30);
    const auto maps = trainer.exposures();
    ASSERT_EQ(maps.size(), 12u);
    for (size_t v = 0; v < maps.size(); ++v)
        EXPECT_EQ(maps.at(t.dataset.views[v].name), maps.at(t.dataset.views[v / 6 * 6].name)) << v;
    EXPECT_NE(maps.at(t.dataset.views[0].name), maps.at(t.dataset.views[6].name));
    EXPECT_EQ(trainer.state().exposure.size(), 2u * 12 * 3) << "maps and moments of two photos";
    expect_resumes(t, trainer, {17});
}

// The left of every photo is darker in one half of them, the right in the other.
TEST(ExposureTraining, a_grid_finds_tones_that_one_map_does_not_long) {
    ProbeCase t = training_of(0.0f);
    t.options.probe_sh = false;
    t.options.sh_degree = 0;
    t.options.exposure = true;
    t.options.exposure_lr_init = 0.01f;
    t.options.exposure_lr_final = 0.001f;
    for (size_t v = 0; v < t.photos.size(); ++v)
        for (size_t i = 0; i < t.photos[v].data.size(); ++i) {
            const double across = double(i / 4 % size_t(t.photos[v].width)) / t.photos[v].width;
            if (i % 4 != 3)
                t.photos[v].data[i] = static_cast<std::uint8_t>(
                    (0.6 + 0.4 * (v % 2 == 0 ? across : 1 - across)) * t.photos[v].data[i]);
        }
    const auto loss = [&](bool grid) {
        t.options.exposure_grid = grid;
        Trainer trainer = t.trainer();
        double sum = 0;
        trainer.on_result = [&](const IterationResult& r) {
            if (r.iteration > 360) sum += r.loss;
        };
        for (int i = 0; i < 400; ++i) trainer.step();
        trainer.drain();
        EXPECT_EQ(trainer.exposures().size(), t.photos.size());
        return sum / 40;
    };
    const double one = loss(false), grid = loss(true);
    EXPECT_LT(grid, 0.85 * one);
}

TEST(AntialiasTraining, writes_splats_that_look_as_they_were_trained) {
    ProbeCase t = training_of(0.0f);
    t.options.probe_sh = false;
    t.options.sh_degree = 0;
    t.options.antialias = true;
    t.options.densify_until = 60;
    Trainer trainer = t.trainer();
    for (int i = 0; i < 120; ++i) trainer.step();
    const SplatModel model = trainer.model();
    EXPECT_TRUE(model.antialias);
    Renderer renderer(shared_device(), model);
    const Camera& camera = t.dataset.views[3].camera;
    const ImageF live = trainer.render(camera), stored = renderer.render(camera);
    EXPECT_TRUE(compare("picture", live.data, stored.data, tolerance("image_float32")));
    const Trainer::State raw = trainer.state();
    EXPECT_NE(raw.model.log_scale, model.log_scale) << "the filter is meant to widen something";
}

TEST(EffectsTraining, a_run_that_was_restored_goes_on_bit_by_bit_slow) {
    ProbeCase t = training_of(0.25f);
    t.options.antialias = t.options.exposure = t.options.exposure_grid = true;
    t.options.densify_until = 180;
    Trainer whole = t.trainer();
    for (int i = 0; i < 130; ++i) whole.step();
    const Trainer::State state = whole.state();
    Trainer resumed = t.trainer();
    resumed.restore(state);
    for (int i = 0; i < 60; ++i) {  // over a probe
        whole.step();
        resumed.step();
    }
    EXPECT_TRUE(same_state(whole, resumed));
    const Trainer::State a = whole.state(), b = resumed.state();
    EXPECT_EQ(a.smoothing, b.smoothing);
    EXPECT_EQ(a.exposure, b.exposure);
    EXPECT_EQ(a.next_probe, b.next_probe);
}

TEST(EffectsRendering, auto_equals_all_in_the_picture) {
    const TestScene s = random_scene({.count = 300, .width = 100, .height = 70, .sh_degree = 3});
    for (const bool matte : {true, false}) {
        SplatModel model = s.model;
        if (matte) model.sh_rest.assign(model.sh_rest.size(), 0.0f);
        View view;
        view.camera = s.camera;
        view.camera.cx = 50;
        view.camera.cy = 35;
        view.lens.parameters = {view.camera.fx, view.camera.fy, 50, 35};
        std::vector<ImageF> pictures;
        for (const char* choice : {"auto", "+off_centre,+sh", "all"}) {
            const EffectPlan plan = plan_rendering(model, {view}, {}, parse_effects(choice));
            SplatModel planned = model;
            apply_plan(plan, planned);
            EXPECT_EQ(planned.sh_degree, matte && choice == std::string("auto") ? 0 : 3);
            ForwardOptions options;
            options.effects = plan.projection();
            Renderer renderer(shared_device(), planned, options);
            pictures.push_back(renderer.render(view.camera));
        }
        EXPECT_TRUE(same_but_for_fusing(pictures[0].data, pictures[1].data, 1e-5));
        EXPECT_TRUE(same_but_for_fusing(pictures[0].data, pictures[2].data, 1e-5));
    }
}

// What stereo found is not there when a run goes on, and far off its middle may lie elsewhere.
TEST(DenseStart, far_off_goes_on_from_a_checkpoint_with_the_same_bits) {
    TinyTraining t = tiny_training();
    const glm::dvec3 far(1e5, 0, 0);
    for (View& view : t.dataset.views) view.camera.translation -= view.camera.rotation * far;
    for (std::size_t i = 0; i < t.dataset.points.position.size(); i += 3)
        t.dataset.points.position[i] += far.x;
    t.options.start = StartPoints::dense;
    t.dataset.start = t.dataset.points;
    for (std::size_t i = 0; i < t.dataset.start.position.size(); i += 3)
        t.dataset.start.position[i] += 1;
    Trainer whole = t.trainer();
    run_to(whole, 20);
    Checkpoint checkpoint;
    checkpoint.state = whole.state();
    run_to(whole, 30);
    t.dataset.start = {};
    ASSERT_NE(t.start().origin, checkpoint.state.model.origin) << "else this shows nothing";
    Trainer resumed(shared_device(), t.dataset, t.photos,
                    first_model(t.dataset, t.options, checkpoint), t.options);
    resumed.restore(checkpoint.state);
    run_to(resumed, 30);
    EXPECT_TRUE(same_state(whole, resumed));
}

}  // namespace
}  // namespace darb::test
