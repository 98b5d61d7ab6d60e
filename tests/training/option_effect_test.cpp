// SPDX-License-Identifier: MIT
// Every option of the table does something: a short run with another value of it ends in another
// state. An option that is read and ignored fails here.
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>

#include "engine/core/error.h"
#include "engine/data/track_adjustment.h"
#include "tests/support/measured_depths.h"
#include "trainer/options/option_table.h"
#include "trainer/options/strategy.h"

namespace darb::test {
namespace {

/// Another value than the run's, under which 20 iterations differ.
const std::map<std::string, std::string> kOtherValues{
    {"/iterations", "12"},
    {"/batch", "2"},
    {"/seed", "6"},
    {"/max_splats", "40"},
    {"max_memory", "2MB"},
    {"/sh_degree", "0"},
    {"/effects/exposure_lr/0", "0.3"},
    {"/effects/exposure_lr/1", "0.3"},
    {"/effects/depth_weight", "3"},
    {"/effects/surface_from", "0.2"},
    {"/effects/distortion_weight", "3"},
    {"/effects/flatness_weight", "3"},
    {"/effects/camera_lr", "0.7"},
    {"/effects/camera_from", "0.5"},
    {"/effects/camera_anchor", "3"},
    {"/lambda_dssim", "0.5"},
    {"/position_lr/0", "0.01"},
    {"/position_lr/1", "0.0001"},
    {"/scale_lr", "0.02"},
    {"/rotation_lr", "0.02"},
    {"/opacity_lr", "0.01"},
    {"/shape_lr", "0.2"},
    {"/learn_kernel", "4"},
    {"/kernel_lr", "0.5"},
    {"/sh_lr/0", "0.01"},
    {"/sh_rest_every", "3"},
    {"/position_lr_falls", "0.5"},
    {"/final_lr_share", "0.5"},
    {"/average_begin", "1"},
    {"/sh_interval", "3"},
    {"/densify_from", "9"},
    {"/densify_until", "9"},
    {"/densify_interval", "3"},
    {"/densify_grad_threshold", "0.75"},
    {"/clone_split_extent", "7"},
    {"/prune_opacity", "0.5"},
    {"/prune_extent", "0.001"},
    {"/opacity_reset/0", "5"},
    {"/noise_lr", "1"},
    {"/regularisers/0", "0.5"},
    {"/regularisers/1", "0.5"},
    {"/largest_scale", "0.01"},
    {"/clearance", "0"},
    {"/random_points", "30"},
    {"/initial_opacity", "0.6"},
    {"/initial_scale", "0.5"},
};

std::string key_of(const OptionRow& row) {
    return *row.setting != '\0'                                       ? row.setting
           : std::holds_alternative<bool TrainOptions::*>(row.member) ? "speed_up_short_runs"
                                                                      : "max_memory";
}

/// Tracks that lie a little beside where the points are drawn.
void add_tracks(Dataset& dataset) {
    PointCloud& points = dataset.points;
    points.seen_begin.push_back(0);
    for (std::size_t p = 0; p < points.size(); ++p) {
        const double* x = &points.position[3 * p];
        for (std::size_t v = 0; v < dataset.views.size(); ++v) {
            View& view = dataset.views[v];
            view.lens.width = view.camera.width;
            view.lens.height = view.camera.height;
            const glm::dvec2 at = pinhole_pixel(view.camera, {x[0], x[1], x[2]});
            points.seen_by.push_back(static_cast<std::uint32_t>(v));
            points.seen_at.push_back(static_cast<float>(at.x / view.camera.width + 0.02));
            points.seen_at.push_back(static_cast<float>(at.y / view.camera.height));
        }
        points.seen_begin.push_back(points.seen_by.size());
    }
}

/// A run in which all of training takes part: growth, resets, transparent pixels, a splat beside a
/// camera.
TinyTraining run_for(const OptionRow& row) {
    const std::string key = key_of(row);
    TinyTraining t = tiny_training(key == "/resolution_ramp"
                                       ? TinyOptions{.views = 3, .width = 220, .height = 16}
                                       : TinyOptions{.views = 4, .width = 32, .height = 24});
    for (ImageU8& photo : t.photos)
        for (std::size_t i = 3; i < photo.data.size() / 2; i += 4) photo.data[i] = 100;
    TrainOptions& o = t.options;
    o.iterations = 20;
    o.sh_interval = 2;
    o.densify_from = 3;
    o.densify_until = 18;
    o.densify_interval = 4;
    o.opacity_reset_interval = 7;
    o.clearance = 0.9f;
    o.exposure = key.starts_with("/effects/exposure_");
    o.depth = key == "/effects/depth_weight";
    o.surface = key.starts_with("/effects/surface_") || key == "/effects/distortion_weight" ||
                key == "/effects/flatness_weight";
    if (key.starts_with("/effects/depth"))
        add_measured_depths(tiny_truth({.width = 32, .height = 24}), t);
    o.refine_cameras = key.starts_with("/effects/camera_");
    if (o.refine_cameras) add_tracks(t.dataset);
    const std::string strategies = row.strategies;
    if (strategies == "mcmc") o.strategy = Strategy::mcmc;
    if (strategies == "budget") o.strategy = Strategy::budget;
    if (!strategies.empty() && !strategies.starts_with("adc")) o.max_splats = 80;
    if (key == "/shape_lr") o.kernel = KERNEL_BETA;
    if (key == "/kernel_lr") o.learn_kernel = 4;
    if (key == "/random_points") t.dataset.points = {};
    return t;
}

void set_other(const OptionRow& row, TrainOptions& o) {
    if (const auto* const flag = std::get_if<bool TrainOptions::*>(&row.member)) {
        o.*(*flag) = !(o.*(*flag));
        return;
    }
    const auto value = kOtherValues.find(key_of(row));
    ASSERT_NE(value, kOtherValues.end()) << "a value for " << key_of(row);
    set_option(row, value->second, o);
}

/// After the last iteration; nothing where the device's budget does not hold the run.
std::optional<TrainerState> trained(const TinyTraining& t) try {
    std::optional<Device> own;
    if (t.options.max_memory_bytes) own.emplace(device_options());  // the other is in use
    Device& device = own ? *own : shared_device();
    SplatModel start = t.start();
    const glm::dvec3 beside = t.dataset.views[1].camera.centre() * 0.9;  // points are around 0
    for (int c = 0; c < 3; ++c) start.position[c] = static_cast<float>(beside[c]);
    Trainer trainer(device, t.dataset, t.photos, start, t.options);
    while (trainer.iteration() < t.options.iterations) trainer.step();
    return trainer.state();
} catch (const Error&) {
    return std::nullopt;
}

bool same(const TrainerState& a, const TrainerState& b) {
    for (int i = 0; i < kAttributeCount; ++i)
        if (attribute_values(a.model, i) != attribute_values(b.model, i)) return false;
    return a.moments == b.moments && a.exposure == b.exposure && a.smoothing == b.smoothing;
}

TEST(OptionEffect, another_value_of_each_option_trains_another_scene_long) {
    std::size_t rows = 0;
    std::map<std::string, std::optional<TrainerState>> usual_of;  // by what run_for goes by
    for (const OptionRow& row : option_rows()) {
        if (std::holds_alternative<std::monostate>(row.member)) continue;
        SCOPED_TRACE(key_of(row));
        if (key_of(row) == "/end_without_gain")
            continue;  // of the run, not of its trainer: see run_files_test
        TinyTraining t = run_for(row);
        const std::string key = key_of(row);
        const bool special = key == "/resolution_ramp" || key == "/random_points";
        const std::string run = strategy_name(t.options.strategy).data() + std::string(" ") +
                                (special ? key : "") + (t.options.exposure ? "exposure" : "") +
                                (t.dataset.views[0].depth.empty() ? "" : "depths") +
                                (t.options.depth ? " compared" : "") +
                                (t.options.surface ? "surface" : "") +
                                (t.options.refine_cameras ? "cameras" : "") +
                                (t.options.learn_kernel > 0 ? "learned" : "");
        if (!usual_of.contains(run)) usual_of[run] = trained(t);
        const std::optional<TrainerState>& usual = usual_of[run];
        ASSERT_TRUE(usual);
        set_other(row, t.options);
        const std::optional<TrainerState> other = trained(t);
        EXPECT_TRUE(!other || !same(*usual, *other)) << "it changes nothing";
        EXPECT_TRUE(other || key == "max_memory");
        ++rows;
    }
    EXPECT_GT(rows, 40U);
}

}  // namespace
}  // namespace darb::test
