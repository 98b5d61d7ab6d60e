// SPDX-License-Identifier: MIT
// The viewer's pictures without a window: display modes, motion and rest, accuracy and effects.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "engine/data/metrics.h"
#include "tests/support/test_lenses.h"
#include "tests/support/viewer_fixture.h"
#include "viewer/scene.h"
#include "viewer/switches.h"

namespace darb::test {
namespace {

TEST_F(ViewerTest, Display_modes_differ_from_the_picture_and_from_each_other) {
    load(file_);
    std::vector<ImageU8> shots;
    DisplaySettings& d = viewer_->session().display;
    const DisplaySettings plain = d;
    shots.push_back(shot());
    d.mode = VIEW_DEPTH;
    shots.push_back(shot());
    d.mode = VIEW_COUNT;
    d.count_max = 30;
    shots.push_back(shot());
    d = plain;
    d.style = SplatStyle::points;
    shots.push_back(shot());
    d.style = SplatStyle::ellipsoids;
    shots.push_back(shot());
    for (size_t a = 0; a < shots.size(); ++a)
        for (size_t b = a + 1; b < shots.size(); ++b)
            EXPECT_GT(largest_difference(shots[a], shots[b]), 60) << a << " and " << b;
    d = plain;
    EXPECT_EQ(largest_difference(shot(), shots[0]), 0);
}

// Two opaque splats side by side, one nearer: the nearer is the lighter.
TEST_F(ViewerTest, Depth_near_is_lighter_than_far) {
    SplatModel m;
    m.resize(2);
    for (size_t i = 0; i < 2; ++i) {
        m.position[3 * i] = i == 0 ? -0.5f : 0.5f;
        m.position[3 * i + 2] = i == 0 ? -0.3f : 0.3f;
        m.rotation[4 * i] = 1;
        m.opacity_logit[i] = 6;
        for (size_t c = 0; c < 3; ++c) m.log_scale[3 * i + c] = -1.5f;
    }
    write_ply(file_, m);
    load(file_);
    viewer_->session().display.mode = VIEW_DEPTH;
    const ImageU8 image = shot();
    const Camera camera = viewer_->session().navigation.camera(kWidth, kHeight);
    int light[2];
    for (int i = 0; i < 2; ++i) {
        const glm::dvec3 p = camera.rotation * glm::dvec3(m.position[3 * i], m.position[3 * i + 1],
                                                          m.position[3 * i + 2]) +
                             camera.translation;
        const int x = static_cast<int>(camera.fx * p.x / p.z + camera.cx);
        const int y = static_cast<int>(camera.fy * p.y / p.z + camera.cy);
        light[i] = image.at(x, y, 0) + image.at(x, y, 1) + image.at(x, y, 2);
    }
    EXPECT_GT(light[0], light[1] + 30);
}

std::string slowest(const std::vector<PassTime>& passes) {
    const auto most = std::max_element(passes.begin(), passes.end(),
                                       [](const auto& a, const auto& b) { return a.ms < b.ms; });
    return most == passes.end() ? "none" : most->name;
}

// Thousands of splats, each over all of the picture: the blend takes nearly all of the time. Panels
// are drawn between two pictures, as in a window.
TEST_F(ViewerTest, Times_of_passes_stand_at_the_names_that_a_frame_without_a_window_has) {
    SplatModel m;
    m.resize(3000);
    for (size_t i = 0; i < m.size(); ++i) {
        m.position[3 * i + 2] = 0.1f * static_cast<float>(i) / 3000;
        m.rotation[4 * i] = 1;
        m.opacity_logit[i] = -4;
        for (size_t c = 0; c < 3; ++c) m.log_scale[3 * i + c] = 0.5f;
    }
    write_ply(file_, m);
    load(file_);
    const Camera camera = viewer_->session().navigation.camera(kWidth, kHeight);
    Renderer renderer(shared_device(), m, {}, {});
    renderer.render(camera, glm::vec3(0.0f), -1, near_plane());
    if (renderer.pass_times().empty()) GTEST_SKIP() << "a device without timestamps";
    renderer.render(camera, glm::vec3(0.0f), -1, near_plane());
    ASSERT_EQ(slowest(renderer.pass_times()), "blend");
    viewer_->session().panels = true;
    shot();
    // The least of several frames: a busy machine may hold up any pass of one of them.
    std::vector<PassTime> least;
    for (int i = 0; i < 5; ++i) {
        viewer_->session().display.background = {0.1f * static_cast<float>(i + 1), 0, 0};
        shot();
        const auto& passes = viewer_->session().times.passes;
        if (least.empty()) least = passes;
        ASSERT_EQ(passes.size(), least.size());
        for (size_t k = 0; k < passes.size(); ++k) {
            EXPECT_EQ(passes[k].name, least[k].name);
            least[k].ms = std::min(least[k].ms, passes[k].ms);
        }
    }
    EXPECT_EQ(slowest(least), "blend");
}

TEST_F(ViewerTest, Background_is_seen_where_nothing_is) {
    load(file_);
    viewer_->session().edit.remove(scene_.model, {Region::Shape::box, {0, 0, 0}, glm::dvec3(1e3)},
                                   true);
    viewer_->session().ask(request::ShowEdits{});
    viewer_->session().display.background = {1, 0.4f, 0};
    const ImageU8 image = shot();
    EXPECT_EQ(image.at(5, 5, 0), 255);
    EXPECT_EQ(image.at(5, 5, 1), 102);
    EXPECT_EQ(image.at(5, 5, 2), 0);
}

TEST_F(ViewerTest, Kernel_switch_shows_a_difference_and_goes_back) {
    load(file_);
    const ImageU8 own = shot();
    viewer_->session().display.kernel = KERNEL_RAISED_COSINE;
    EXPECT_GT(largest_difference(shot(), own), 3);
    viewer_->session().display.kernel = KERNEL_GAUSSIAN;
    EXPECT_EQ(largest_difference(shot(), own), 0);
}

TEST_F(ViewerTest, Photo_is_left_of_the_split) {
    load(file_);
    viewer_->choose_camera(0);
    const ImageU8 picture = shot();
    Photos& p = viewer_->session().photos;
    p.compare = true;
    const ImageU8 both = shot();
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            for (int c = 0; c < 3; ++c)
                ASSERT_EQ(both.at(x, y, c),
                          x < kWidth / 2 ? photo_.at(x, y, c) : picture.at(x, y, c))
                    << x << ", " << y << ", channel " << c;
}

TEST_F(ViewerTest, Kernels_are_side_by_side_each_as_it_is_alone) {
    load(file_);
    Session& s = viewer_->session();
    const int own = s.display.kernel;
    const std::vector<int> kernels{own, KERNEL_RAISED_COSINE, KERNEL_PARABOLIC};
    std::vector<ImageU8> alone;
    for (const int kernel : kernels) {
        s.display.kernel = kernel;
        alone.push_back(shot());
    }
    s.display.kernel = own;
    s.panes.kernels = {kernels[1], kernels[2]};
    shot();
    s.panes.lines = {0.25f, 0.75f};
    const std::uint32_t drawn = s.times.intersections;
    const ImageU8 all = shot();
    EXPECT_EQ(s.times.intersections, drawn);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            for (int c = 0; c < 3; ++c)
                ASSERT_EQ(all.at(x, y, c), alone[x < kWidth / 4       ? 0
                                                 : x < 3 * kWidth / 4 ? 1
                                                                      : 2]
                                               .at(x, y, c))
                    << x << ", " << y << ", channel " << c;
    ASSERT_EQ(s.panes.psnr_db.size(), 2u);
    for (size_t i = 0; i < 2; ++i)
        EXPECT_NEAR(s.panes.psnr_db[i], psnr(to_float(alone[i + 1]), to_float(alone[0])), 1e-3);
    s.panes.kernels.clear();
    EXPECT_EQ(largest_difference(shot(), alone[0]), 0);
    EXPECT_TRUE(s.panes.psnr_db.empty());
}

TEST_F(ViewerTest, The_error_between_kernels_is_dark_where_they_agree) {
    load(file_);
    Session& s = viewer_->session();
    s.panes.kernels = {KERNEL_RAISED_COSINE};
    s.panes.difference = true;
    shot();
    s.panes.lines = {0};
    const ImageU8 error = shot();
    EXPECT_GT(largest_difference(error, ImageU8(kWidth, kHeight, 3)), 60);
    for (int c = 0; c < 3; ++c) EXPECT_LE(error.at(0, 0, c), 12) << "background beside background";
    s.panes.kernels = {s.display.kernel};
    shot();
    EXPECT_TRUE(s.panes.psnr_db.empty()) << "a kernel is not set beside itself";
}

TEST_F(ViewerTest, The_photo_is_what_kernels_are_measured_against) {
    load(file_);
    viewer_->choose_camera(0);
    write_png(folder_ / "photo.png", shot());
    Session& s = viewer_->session();
    s.photos.compare = true;
    s.panes.kernels = {KERNEL_RAISED_COSINE};
    shot();
    ASSERT_EQ(s.panes.psnr_db.size(), 2u);
    EXPECT_GT(s.panes.psnr_db[0], 50);  // the photo is the first kernel's picture
    EXPECT_LT(s.panes.psnr_db[1], 45);
}

// The window is twice as wide as the photo, which lies in the middle of it.
TEST_F(ViewerTest, Lines_begin_on_the_photo_and_beside_it_its_strip_is_darker) {
    load(file_);
    viewer_->choose_camera(0);
    Session& s = viewer_->session();
    const auto wide = [&] {
        viewer_->frame({}, 2 * kWidth, kHeight, true);
        viewer_->compose();
        viewer_->canvas().submit_and_wait();
        return viewer_->canvas().read_back();
    };
    const ImageU8 alone = wide();
    s.photos.compare = true;
    s.panes.kernels = {KERNEL_RAISED_COSINE};
    wide();
    ASSERT_EQ(s.panes.lines.size(), 2u);
    EXPECT_NEAR(s.panes.lines[0], 0.25 + 0.5 / 3, 1e-6);
    EXPECT_NEAR(s.panes.lines[1], 0.25 + 1.0 / 3, 1e-6);
    s.panes.lines = {0.75f, 1};
    s.panes.difference = true;
    const ImageU8 shown = wide();
    int brightest = 0;
    for (const int x : {3, kWidth / 2 - 1, 2 * kWidth - 4})
        for (int y = 0; y < kHeight; ++y)
            for (int c = 0; c < 3; ++c) {
                brightest = std::max<int>(brightest, alone.at(x, y, c));
                ASSERT_NEAR(shown.at(x, y, c), 0.35 * alone.at(x, y, c), 1) << x << ", " << y;
            }
    EXPECT_GT(brightest, 60);
    ASSERT_EQ(shown.at(kWidth / 2 + 1, 5, 0), photo_.at(1, 5, 0));
}

TEST_F(ViewerTest, Error_map_is_dark_where_the_photo_is_the_picture) {
    load(file_);
    viewer_->choose_camera(0);
    write_png(folder_ / "photo.png", shot());
    viewer_->session().display.mode = VIEW_ERROR;
    const ImageU8 map = shot();
    EXPECT_LE(*std::max_element(map.data.begin(), map.data.end()), 12);
}

TEST_F(ViewerTest, Picture_is_coarse_in_motion_and_refined_at_rest) {
    load(file_);
    const ImageU8 at_rest = shot();
    EXPECT_EQ(viewer_->session().times.quality, MotionQuality());
    Session& s = viewer_->session();
    s.navigation.orbit(0.3, 0);
    shot(false);
    viewer_->presented();
    EXPECT_LT(s.times.quality.scale, 1);
    EXPECT_LT(s.times.quality.splats, 1);
    double next = 0;
    for (int i = 0; i < 1'000'000 && !(s.times.quality == MotionQuality()); ++i)
        next = viewer_->frame({}, kWidth, kHeight, false);
    EXPECT_EQ(s.times.quality, MotionQuality());
    EXPECT_EQ(next, 0);  // the panels show the times of the refined picture, once it is done
    for (int i = 0; i < 6 && next == 0; ++i) {
        shot(false);
        next = viewer_->frame({}, kWidth, kHeight, false);
    }
    EXPECT_EQ(next, std::numeric_limits<double>::infinity());  // then nothing is drawn any more
    EXPECT_TRUE(viewer_->at_rest());
    s.navigation.orbit(-0.3, 0);
    EXPECT_LE(largest_difference(shot(), at_rest), 2);  // the turns cancel up to rounding
}

TEST_F(ViewerTest, A_picture_that_takes_long_is_refined_in_two_steps) {
    load(file_);
    shot();
    shot(false);
    Session& s = viewer_->session();
    s.times.full_ms = 10'000;
    s.navigation.orbit(0.3, 0);
    shot(false);
    EXPECT_FALSE(viewer_->refined());
    bool previewed = false;
    for (int i = 0; i < 1'000'000 && !viewer_->at_rest(); ++i) {
        viewer_->frame({}, kWidth, kHeight, false);
        previewed |= s.times.quality.scale == 1 && s.times.quality.splats < 1;
    }
    EXPECT_TRUE(previewed);
    EXPECT_TRUE(viewer_->refined());
    EXPECT_EQ(s.times.quality, MotionQuality());
}

// What a first frame in motion needs is made while nothing moves; the picture does not change by
// it.
TEST_F(ViewerTest, The_first_frame_in_motion_has_nothing_to_wait_for) {
    load(file_);
    DisplaySettings& d = viewer_->session().display;
    for (const SplatStyle style : {SplatStyle::splats, SplatStyle::points}) {
        d.style = style;
        const ImageU8 at_rest = shot();
        EXPECT_FALSE(viewer_->picture().ready_to_move(d));
        for (int i = 0; i < 20 && !viewer_->at_rest(); ++i)
            EXPECT_EQ(largest_difference(shot(false), at_rest), 0);
        EXPECT_TRUE(viewer_->at_rest());
        viewer_->session().navigation.orbit(0.01, 0);
        shot(false);
        EXPECT_FALSE(viewer_->picture().compiled());
        EXPECT_LT(viewer_->session().times.quality.splats, 1.01);
    }
}

// Half of the splats, the larger ones, are much of the picture; and the deleted ones stay away.
TEST_F(ViewerTest, Motion_shows_the_important_splats_and_no_deleted_ones) {
    for (size_t i = 0; i < scene_.model.size(); ++i) scene_.model.opacity_logit[i] = 4;
    write_ply(file_, scene_.model);
    load(file_);
    viewer_->choose_camera(0);
    const ImageU8 whole = shot();
    SplatPicture picture(shared_device());
    const Scene& s = *viewer_->session().scene;
    picture.set_scene(s.model, s.bounds, most_important(s.model, s.bounds, s.model.size() / 2));
    EXPECT_DOUBLE_EQ(picture.most_moving(), 0.5);
    const auto light = [&](std::optional<double> moving) {
        picture.render(scene_.camera, viewer_->session().display, {}, moving);
        double sum = 0;
        for (const std::uint32_t p : picture.pixels().download<std::uint32_t>(kWidth * kHeight))
            sum += (p & 255) + (p >> 8 & 255) + (p >> 16 & 255);
        return sum;
    };
    const double all = light({}), half = light(0.5), few = light(0.1);
    EXPECT_NEAR(light(1.0), all, 0.02 * all);  // fast accuracy settings
    EXPECT_LT(half, 0.99 * all);
    EXPECT_GT(half, 0.5 * all);
    EXPECT_LT(few, half);
    EXPECT_GT(few, 0);
    picture.set_marks(std::vector<std::uint8_t>(s.model.size(), 1), {});
    EXPECT_EQ(light(0.5), 0);
}

TEST_F(ViewerTest, Degree_of_colour_follows_the_scene) {
    for (const int degree : {1, 3, 0}) {
        SceneOptions options;
        options.count = 20;
        options.sh_degree = degree;
        write_ply(file_, random_scene(options).model);
        load(file_);
        EXPECT_EQ(viewer_->session().sh_degree, degree);
        EXPECT_EQ(viewer_->session().display.sh_degree, degree);
    }
}

TEST_F(ViewerTest, Accuracy_switch_changes_the_picture_and_its_measure_says_how_much) {
    load(file_);
    Session& s = viewer_->session();
    const ImageU8 before = shot();
    s.ask(request::Measure{});
    do shot();
    while (s.progress.measuring >= 0);
    size_t choices = 0;
    for (const int row : kAccuracyRows) choices += row_choices(row, 3).size();
    for (const int row : kEffectRows) choices += row_choices(row, s.sh_degree).size();
    ASSERT_EQ(s.measured.size(), choices);
    const DisplaySettings as_is = s.display;
    s.display = s.own;
    s.display.accuracy = preset_accuracy(kExact);
    const ImageF exact = to_float(shot());
    const std::vector<int> compared = {kPresetRow, kRenderScale, effect_row(EFFECT_VIEW_COLOUR)};
    for (const MeasuredChoice& m : s.measured) {
        const std::string name = row_name(m.row) + " " + row_choices(m.row, 3)[m.choice];
        EXPECT_GT(m.psnr_db, 15) << name;
        s.display = as_is;
        choose(m.row, m.choice, s.display);
        EXPECT_EQ(chosen(m.row, s.display), m.choice) << name;
        if (std::find(compared.begin(), compared.end(), m.row) == compared.end()) continue;
        const double expected = psnr(to_float(shot()), exact);
        if (std::isinf(expected))
            EXPECT_TRUE(std::isinf(m.psnr_db)) << name;
        else
            EXPECT_NEAR(m.psnr_db, expected, 1e-6) << name;
    }
    s.display = as_is;
    EXPECT_EQ(largest_difference(shot(), before), 0);
    s.display.accuracy = preset_accuracy(kFast);
    EXPECT_GT(largest_difference(shot(), before), 0);
    s.display.mode = VIEW_COUNT;  // modes that need float32 and centre order go on working
    s.display.accuracy.choice[kDepthOrder] = 2;
    shot();
    s.display.mode = VIEW_DEPTH;
    shot();
    EXPECT_TRUE(s.error.empty()) << s.error;
}

TEST_F(ViewerTest, Antialiasing_is_taken_from_the_file) {
    scene_.model.antialias = true;
    write_ply(file_, scene_.model);
    load(file_);
    EXPECT_TRUE(viewer_->session().display.effects.antialias);
    viewer_->choose_camera(0);
    const ImageU8 with = shot();
    EXPECT_LE(largest_difference(with, rendered(scene_.model, scene_.camera)), 1);
    viewer_->session().display.effects.antialias = false;
    EXPECT_GT(largest_difference(with, shot()), 0);
}

// As darb render with the same words.
TEST_F(ViewerTest, Accuracy_and_effects_are_those_of_the_command_line) {
    options_.accuracy = preset_accuracy(kFast);
    options_.accuracy.choice[kRenderScale] = 1;
    options_.accuracy.choice[kShDegree] = find_choice(kShDegree, "1");
    options_.effects = parse_effects("+antialias,-near");
    make_viewer(options_);
    load(file_);
    viewer_->choose_camera(0);
    const Session& s = viewer_->session();
    SplatModel model = scene_.model;
    model.antialias = true;
    ProjectionEffects effects;
    effects.near_care = false;
    EXPECT_LE(
        largest_difference(shot(), rendered(model, scene_.camera, options_.accuracy, effects)), 1);
    EXPECT_EQ(s.display.sh_degree, 1);
    EXPECT_FALSE(s.plan->on(EFFECT_NEAR));
    EXPECT_TRUE(s.plan->row(EFFECT_ANTIALIAS).reason.starts_with("--effects"));
    viewer_->session().display.effects.near_care = true;
    viewer_->session().ask(request::FollowPlan{});
    shot();
    EXPECT_FALSE(s.display.effects.near_care);
}

TEST_F(ViewerTest, Cameras_with_a_lens_are_looked_through_with_it) {
    const Camera pinhole = scene_.camera;
    scene_.camera.lens = test_lenses()[0].second;
    options_.views[0].camera = scene_.camera;
    make_viewer(options_);
    load(file_);
    EXPECT_TRUE(viewer_->session().plan->on(EFFECT_LENS));
    viewer_->choose_camera(0);
    ProjectionEffects effects;
    effects.lens = true;
    const ImageU8 bent = shot();
    EXPECT_LE(largest_difference(bent, rendered(scene_.model, scene_.camera, {}, effects)), 1);
    viewer_->session().display.effects.lens = false;
    EXPECT_GT(largest_difference(shot(), bent), 20);
    EXPECT_LE(largest_difference(shot(), rendered(scene_.model, pinhole)), 1);
}

}  // namespace
}  // namespace darb::test
