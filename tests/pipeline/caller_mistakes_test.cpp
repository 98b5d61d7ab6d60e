// SPDX-License-Identifier: MIT
// Mistakes of a caller of the library give an Error with a remedy, and leave the object usable.
#include "engine/core/error.h"
#include "engine/data/depth_io.h"
#include "engine/data/image_io.h"
#include "engine/data/lens_model.h"
#include "engine/data/metrics.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/relocation_table.h"
#include "engine/plan/accuracy.h"
#include "engine/primitives/radix_sort.h"
#include "engine/raster/blend_backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/loss.h"
#include "engine/reference/comparison.h"
#include "engine/reference/reference_density_control.h"
#include "engine/reference/reference_loss.h"
#include "engine/reference/reference_render.h"
#include "engine/render/renderer.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"
#include "tests/support/tiny_training.h"
#include "trainer/options/option_table.h"
#include "trainer/step/exposure.h"
#include "trainer/step/optimizer.h"
#include "trainer/step/smoothing.h"

namespace darb::test {
namespace {

/// The message of the Error, which must have a hint; "" where there is none.
template <class Action>
std::string refusal(Action&& action) {
    try {
        action();
    } catch (const Error& error) {
        EXPECT_FALSE(error.hint.empty()) << error.what();
        return error.what();
    }
    return "";
}

TEST(CallerMistakes, a_renderer_says_what_it_needs_and_goes_on) {
    const TestScene s = random_scene({.count = 20, .width = 32, .height = 24, .sh_degree = 0});
    Renderer renderer(shared_device(), s.model);
    EXPECT_NE(refusal([&] { renderer.render_depth(); }).find("depths"), std::string::npos);
    Camera lens = s.camera;
    lens.lens.active = true;
    EXPECT_NE(refusal([&] { renderer.render(lens); }).find("lens"), std::string::npos);
    EXPECT_EQ(renderer.render(s.camera).width, 32);
    EXPECT_EQ(renderer.render_depth().width, 32);

    ForwardOptions half;
    half.storage = STORAGE_FLOAT16;
    Renderer small(shared_device(), s.model, half);
    small.render(s.camera);
    EXPECT_NE(refusal([&] { small.render_depth(); }).find("float32"), std::string::npos);
}

TEST(CallerMistakes, passes_say_what_does_not_fit) {
    Device& device = shared_device();
    const TestScene s = random_scene({.count = 2'000, .width = 32, .height = 24, .sh_degree = 0});
    ForwardOptions options;
    options.store_for_backward = true;
    options.depth_order = DEPTH_ORDER_PIXEL;
    EXPECT_NE(refusal([&] { Forward(device, options); }).find("walked back"), std::string::npos);
    options.depth_order = DEPTH_ORDER_CENTRE;
    options.alpha_cutoff = 2;
    EXPECT_NE(refusal([&] { Forward(device, options); }).find("cutoff"), std::string::npos);
    options.alpha_cutoff = 1.0f / 255;
    options.evaluation = 7;
    EXPECT_NE(refusal([&] { Forward(device, options); }).find("evaluation"), std::string::npos);
    options.evaluation = EVALUATION_POLYNOMIAL;

    FrameBuffers buffers(device, options);
    Forward forward(device, options);
    BlendBackward backward(device, options);
    const GpuSplats splats(device, s.model, false);
    FrameView view{camera_data(s.camera, s.model.origin)};
    const Buffer cameras = upload_cameras(device, {view.camera});
    view.cameras = &cameras;
    Commands commands(device);
    buffers.reserve(10, 4'096, s.camera.width, s.camera.height);  // 1,024 splats, the least
    commands.begin();
    EXPECT_NE(
        refusal([&] { forward.record(commands, splats, view, buffers.frame()); }).find("reserve"),
        std::string::npos);
    buffers.reserve(splats.count(), 4'096, s.camera.width, s.camera.height);
    forward.record(commands, splats, view, buffers.frame());
    const Buffer d_image(device, "d_image", 32 * 24 * 12);
    EXPECT_NE(
        refusal([&] { backward.record(commands, view, buffers.frame(), d_image); }).find("reserve"),
        std::string::npos);
    commands.submit_and_wait();
}

TEST(CallerMistakes, sorts_and_losses_check_their_sizes) {
    Device& device = shared_device();
    EXPECT_NE(refusal([&] { Scan(device, 0); }), "");
    EXPECT_NE(refusal([&] { RadixSort(device, 0); }), "");
    EXPECT_NE(refusal([&] { Loss(device, 0, 4); }), "");
    Loss loss(device, 8, 8);
    Scan scan(device, 100);
    RadixSort sort(device, 100);
    const Buffer few(device, "few", 16), words(device, "words", 400);
    Commands commands(device);
    commands.begin();
    commands.pass("mistakes");
    EXPECT_NE(refusal([&] {
                  loss.record(commands, {few, few, few, few}, 9, 8, glm::vec3(0));
              }),
              "");
    EXPECT_NE(refusal([&] { scan.record(commands, few, words, few, 0, few); }), "");
    EXPECT_NE(refusal([&] { scan.record(commands, words, words, few, 16, few); }), "");
    EXPECT_NE(refusal([&] { scan.record(commands, words, words, few, 2, few); }), "");
    EXPECT_NE(refusal([&] { sort.record(commands, few, words, few, 0, 8); }), "");
    EXPECT_NE(refusal([&] { sort.record(commands, words, words, few, 0, 33); }), "");
    commands.submit_and_wait();
}

TEST(CallerMistakes, pictures_and_scenes_that_cannot_be_worked_on) {
    const ImageF picture(4, 3, 3), other(3, 4, 3);
    EXPECT_NE(refusal([&] { psnr(picture, other); }).find("4x3x3"), std::string::npos);
    EXPECT_NE(refusal([&] { psnr(ImageF(), ImageF()); }), "");
    EXPECT_NE(refusal([&] { encode_png(ImageU8()); }), "");
    EXPECT_NE(refusal([&] { orient_image(ImageU8(2, 2, 3), 9); }).find("9"), std::string::npos);
    EXPECT_NE(refusal([&] { box_downscale(ImageU8(2, 2, 4), 3, 1); }), "");
    ImageU8 rgb(2, 2, 3);
    EXPECT_NE(refusal([&] { apply_mask(rgb, ImageU8(2, 2, 1)); }), "");
    EXPECT_NE(refusal([&] { write_depth_png("/nowhere.png", picture, 0); }), "");
    LensModel lens;
    lens.model = "NO_MODEL";
    EXPECT_NE(refusal([&] { Lens{lens}; }).find("NO_MODEL"), std::string::npos);
    EXPECT_NE(refusal([&] { static_cast<void>(lens.distorted()); }), "");
    EXPECT_NE(refusal([&] { static_cast<void>(Accuracy{}.of(kAccuracyCount)); }), "");
    SplatModel model = random_scene({.count = 3}).model;
    EXPECT_NE(refusal([&] { transform_splats({.scale = 0}, model); }).find("scale"),
              std::string::npos);
    EXPECT_NE(
        refusal([&] { encode_splats(SplatFormat::ksplat, model, "a.ksplat"); }).find("a.ksplat"),
        std::string::npos);
}

TEST(CallerMistakes, kernels_and_their_tables) {
    EXPECT_NE(refusal([] { static_cast<void>(kernel_name(KERNEL_ROWS)); }), "");
    EXPECT_NE(refusal([] { static_cast<void>(derived_kernel(-1)); }), "");
    const DerivedKernel& rings = derived_kernel(*kernel_with_pulses(KERNEL_SINC, 2));
    EXPECT_NE(refusal([&] { static_cast<void>(rings.value(Footprint::exact, 1)); }), "");
    EXPECT_NE(refusal([&] { static_cast<void>(rings.radius_quantile(1)); }), "");
    EXPECT_NE(refusal([] { kernel_coefficients(KERNEL_SINC, Footprint::psi, 99); }), "");
    EXPECT_NE(refusal([] { relocation_opacity(2, 1); }), "");
    EXPECT_NE(refusal([] { relocation_opacity(0.5, 0); }), "");
    EXPECT_NE(refusal([] { relocation_table(KERNEL_SINC, Footprint::psi, 0, 1); }), "");

    SplatModel model = random_scene({.count = 3}).model;
    model.kernel = KERNEL_ROWS;
    EXPECT_NE(refusal([&] { Renderer(shared_device(), model); }).find("kernel"), std::string::npos);
    model.kernel = KERNEL_GAUSSIAN;
    model.rotation.pop_back();
    EXPECT_NE(refusal([&] { GpuSplats(shared_device(), model, true); }).find("rotation"),
              std::string::npos);
}

TEST(CallerMistakes, the_reference) {
    namespace r = reference;
    const TestScene s = random_scene({.count = 3, .width = 16, .height = 8});
    auto splats = r::make_splats<double>(s.model);
    const auto drawn = r::render(splats, s.camera, {});
    EXPECT_NE(refusal([&] { r::backward(splats, s.camera, {}, drawn, Image<double>(8, 8, 3)); }),
              "");
    Camera none = s.camera;
    none.width = 0;
    EXPECT_NE(refusal([&] { r::render(splats, none, {}); }), "");
    splats.sh_dc.pop_back();
    EXPECT_NE(refusal([&] { r::render(splats, s.camera, {}); }).find("sh_dc"), std::string::npos);
    const Image<double> picture(4, 3, 3), grey(4, 3, 1);
    EXPECT_NE(refusal([&] { r::loss(picture, grey, {}); }), "");
    EXPECT_NE(refusal([&] { r::kernel_table(KERNEL_ROWS, Footprint::psi, 0); }), "");
    EXPECT_NE(refusal([&] { r::kernel_table(0, Footprint::psi, -1); }), "");
    EXPECT_NE(refusal([] { r::tolerance("none of these"); }).find("none of these"),
              std::string::npos);
    std::vector<double> three(3), two(2);
    EXPECT_NE(refusal([&] { r::comparison_stats(three, two, r::tolerance("gradient_float32")); }),
              "");
    const std::vector<std::uint32_t> no_weights;
    EXPECT_NE(refusal([&] { r::relocation_plan(no_weights, 1, 0); }), "");
}

TEST(CallerMistakes, photos_and_states_that_do_not_fit_the_run) {
    TinyTraining t = tiny_training();
    t.options.exposure = true;
    Trainer trainer = t.trainer();
    trainer.step();
    const TrainerState whole = trainer.state();
    const auto refused = [&](auto&& spoil) {
        TrainerState state = whole;
        spoil(state);
        return refusal([&] { trainer.restore(state); });
    };
    EXPECT_NE(refused([](TrainerState& s) { s.moments.pop_back(); }).find("moments"),
              std::string::npos);
    EXPECT_NE(refused([](TrainerState& s) { s.moments[kRotation].pop_back(); }).find("rotation"),
              std::string::npos);
    EXPECT_NE(refused([](TrainerState& s) { s.model.position.pop_back(); }).find("position"),
              std::string::npos);
    EXPECT_NE(refused([](TrainerState& s) { s.exposure.pop_back(); }).find("exposure"),
              std::string::npos);
    EXPECT_NE(refused([](TrainerState& s) { s.gradient_sum.pop_back(); }), "");
    EXPECT_NE(refused([](TrainerState& s) { s.mean.resize(1); }), "");
    EXPECT_NE(refused([](TrainerState& s) { s.smoothing.resize(1); }), "");
    trainer.restore(whole);
    trainer.step();
    trainer.drain();

    std::vector<ImageU8> photos = t.photos;
    photos.pop_back();
    const auto train = [&] { Trainer(shared_device(), t.dataset, photos, t.start(), t.options); };
    EXPECT_NE(refusal(train).find("5 for 6"), std::string::npos);
    photos = t.photos;
    photos[1] = ImageU8(7, 5, 4);
    EXPECT_NE(refusal(train).find("7x5x4"), std::string::npos);

    Exposure exposure(shared_device(), {2}, 64);
    EXPECT_NE(refusal([&] { exposure.restore({1, 2, 3}); }).find("3 values"), std::string::npos);
    EXPECT_NE(refusal([&] { bake_smoothing(whole.model, {}); }), "");
    EXPECT_NE(refusal([] { static_cast<void>(option_row("--no-such")); }).find("--no-such"),
              std::string::npos);
}

TEST(CallerMistakes, a_mean_of_other_splats) {
    Device& device = shared_device();
    IterateAverage average(device);
    const GpuSplats three(device, random_scene({.count = 3}).model, false),
        four(device, random_scene({.count = 4}).model, false);
    average.add(three);
    EXPECT_NE(refusal([&] { average.add(four); }).find("mean of position"), std::string::npos);
    average.add(three);
    EXPECT_EQ(average.count(), 2U);
    average.clear();
    average.add(four);
}

}  // namespace
}  // namespace darb::test
