// SPDX-License-Identifier: MIT
// The hard cases trained: the losses of a few steps are those of the whole training loop in double
// (render, loss, gradients and Adam of the reference), and density control and opacity resets leave
// everything finite.
#include "engine/check/device_walk.h"
#include "engine/check/hard_cases.h"
#include "engine/reference/reference_density_control.h"
#include "engine/reference/reference_loss.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/tiny_training.h"

namespace darb::test {
namespace {

constexpr int kSteps = 4, kIterations = 10;  // the rest with density control

struct Training {
    Dataset dataset;
    ImageU8 photo;  // RGB
    std::vector<ImageU8> photos;
    TrainOptions options;
};

// Waves in every colour, so that no pixel meets its photo by chance.
ImageU8 photo_for(const Camera& camera) {
    ImageU8 photo(camera.width, camera.height, 3);
    for (size_t i = 0; i < photo.data.size(); ++i)
        photo.data[i] = static_cast<std::uint8_t>(128 + 100 * std::sin(0.37 * double(i)));
    return photo;
}

// One view to train on; a second, held out, gives the scene its extent.
Training training_of(const check::HardCase& c) {
    Training t;
    View view;
    view.name = "seen";
    view.camera = c.scene.camera;
    t.dataset.root = c.name;
    t.dataset.views = {view, view};
    t.dataset.views[1].is_test = true;
    t.dataset.views[1].camera.translation.x += 2;
    t.photo = photo_for(view.camera);
    t.photos = {with_alpha(t.photo), with_alpha(t.photo)};
    TrainOptions& o = t.options;
    o.iterations = kIterations;
    o.kernel = c.scene.model.kernel;
    o.footprint = c.scene.model.footprint;
    o.sh_degree = c.scene.model.sh_degree;
    o.sh_interval = 1;
    o.random_background = o.resolution_ramp = false;
    o.position_lr_init = o.position_lr_final = 1e-3f;
    o.final_lr_share = 1;
    o.opacity_weight = o.scale_weight = 0;
    o.largest_scale = 0;
    o.densify_from = kSteps;
    o.densify_until = kIterations + 1;
    o.densify_interval = 2;
    o.densify_grad_threshold = 1e-7f;
    o.opacity_reset_interval = 5;
    o.prune_opacity = 0.01f;
    o.prune_extent = 1e9f;
    o.max_splats = static_cast<std::uint32_t>(2 * c.scene.model.size() + 10);
    return t;
}

struct Result {
    std::vector<double> loss;  // loss of each step
    std::uint32_t splats = 0;
    std::uint64_t bad_gradients = 0;
    bool finite = true;
};

Result train(const Training& t, const SplatModel& start) {
    Result result;
    Trainer trainer(shared_device(), t.dataset, t.photos, start, t.options);
    trainer.on_result = [&](const IterationResult& r) { result.loss.push_back(r.loss); };
    while (trainer.iteration() < t.options.iterations) trainer.step();
    const Trainer::State state = trainer.state();
    for (int a = 0; a < kAttributeCount; ++a) {
        for (const float v : attribute_values(state.model, a)) result.finite &= std::isfinite(v);
        for (const float v : state.moments[a]) result.finite &= std::isfinite(v);
    }
    result.splats = trainer.splat_count();
    result.bad_gradients = trainer.counters().bad_gradients;
    return result;
}

// Parameters are kept in double, and rounded for a render as the device's are.
std::vector<double> losses_in_double(const Training& t, const check::HardCase& c, double extent,
                                     size_t steps) {
    SplatModel model = c.scene.model;
    const TrainOptions& o = t.options;
    const Schedule::Rates first = Schedule(o).first;
    const double rates[] = {
        first.position * extent, first.scale, first.rotation, first.opacity, first.sh_dc,
        first.sh_rest,           first.shape};
    std::array<std::vector<double>, kAttributeCount> value, m1, m2;
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& from = attribute_values(model, a);
        value[a].assign(from.begin(), from.end());
        m1[a].assign(from.size(), 0.0);
        m2[a].assign(from.size(), 0.0);
    }
    const Image<double> truth = reference::to_unit_range<double>(t.photo);
    std::vector<double> losses;
    for (int step = 1; step <= static_cast<int>(steps); ++step) {
        check::WalkSettings settings = c.settings;
        settings.sh_degree = std::min(step, o.sh_degree);
        Image<double> image(truth.width, truth.height, 3);
        image.data = check::walk_in_double(model, c.scene.camera, {}, settings).image;
        const auto loss = reference::loss(image, truth);
        losses.push_back(loss.loss);
        if (losses.size() == steps) break;
        const check::WalkTruth g =
            check::walk_in_double(model, c.scene.camera, loss.d_image, settings);
        for (int a = 0; a < kAttributeCount; ++a) {
            reference::adam_step<double>(value[a], g.d[a], m1[a], m2[a], rates[a], step);
            std::vector<float>& to = attribute_values(model, a);
            for (size_t i = 0; i < to.size(); ++i) to[i] = static_cast<float>(value[a][i]);
        }
    }
    return losses;
}

// The cases of thin layers come with a cut-off that training does not offer: thicker layers then.
void adapt_cutoff(check::HardCase& c, TrainOptions& options) {
    if (c.settings.alpha_cutoff > 0.5 * ALPHA_CUTOFF_DEFAULT) return;
    options.accuracy.choice[kAlphaCutoff] = find_choice(kAlphaCutoff, "1/1024");
    c.settings.alpha_cutoff = 1.0f / 1024;
    std::fill(c.scene.model.opacity_logit.begin(), c.scene.model.opacity_logit.end(), -6.7f);
}

// The steps before which a scene has gradients that float32 knows and an order of its splats: equal
// depths differ by rounding after the first.
size_t comparable_steps(const check::HardCase& c) {
    return !c.gradient || c.name == "equal_depths" ? 1 : kSteps;
}

TEST(HardCaseTraining, losses_match_double_and_density_control_leaves_everything_finite) {
    size_t grown = 0;
    for (check::HardCase c : check::hard_cases(KERNEL_RAISED_COSINE, Footprint::psi)) {
        SCOPED_TRACE(c.name);
        Training t = training_of(c);
        adapt_cutoff(c, t.options);
        const Result result = train(t, c.scene.model);
        ASSERT_EQ(result.loss.size(), size_t{kIterations});
        EXPECT_TRUE(result.finite);
        EXPECT_EQ(result.bad_gradients, 0U);
        grown += result.splats > c.scene.model.size() ? 1 : 0;

        const size_t steps = comparable_steps(c);
        const std::vector<double> expected = losses_in_double(t, c, scene_extent(t.dataset), steps);
        EXPECT_TRUE(compare(c.name, expected, std::span(result.loss).first(steps),
                            tolerance("training_loss_float32")));
        if (c.expects_splats) {
            EXPECT_NE(result.loss[kSteps - 1], result.loss[0]) << "nothing moved";
        }
    }
    EXPECT_GT(grown, 10U) << "density control must take part";
}

}  // namespace
}  // namespace darb::test
