// SPDX-License-Identifier: MIT
// Measures a scene's pictures against photos, at the photos' size and at others.
#pragma once

#include <cstdio>
#include <filesystem>
#include <functional>
#include <glm/vec3.hpp>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/plan/accuracy.h"
#include "engine/plan/effect_plan.h"
#include "engine/ranks/ranks.h"
#include "engine/report/table.h"
#include "engine/scene/splat_model.h"
#include "trainer/run/run.h"

namespace darb {

struct SceneEvaluation {
    Accuracy accuracy = preset_accuracy(kBalanced);
    EffectChoice effects;
    glm::vec3 background{0.0f};
    bool fit_exposure = false;   // first fit each picture's exposure to its photo
    bool align_cameras = false;  // first align each camera to its photo, by CameraAlignment
    bool alpha_is_mask = false;  // as in the data set
    // as in the data set; measured depths are compared where views have them
    double depth_scale = 1;
    bool flip = false;  // also measure FLIP
    /// Gets each picture of this process with its photo, in any order of the views.
    std::function<void(const View&, const ImageF& picture, const ImageU8& photo)> on_picture = {};
    Ranks* ranks = nullptr;  // ranks that share the views; null: only this process
};

/// Measures the model's pictures of these views, and their means. views: at the size to measure at.
/// Throws Error where a picture is too large for the device.
Evaluation evaluate_scene(Device& device, const SplatModel& model, std::vector<View> views,
                          const SceneEvaluation& options);

/// An evaluation at one of several scales.
struct AtScale {
    double scale = 1;
    int width = 0, height = 0;  // px, of the first view
    Evaluation evaluation;
};

/// {"mean": ..., "views": ...}, or {"scales": [the same with scale, width and height]}. This
/// measures at several sizes: scales[i] belongs to sizes[i].
std::vector<AtScale> evaluate_scales(Device& device, const SplatModel& model,
                                     const std::vector<double>& scales,
                                     const std::vector<std::vector<View>>& sizes,
                                     const SceneEvaluation& options);

nlohmann::json evaluation_json(const Evaluation& evaluation);
nlohmann::json evaluation_json(const std::vector<AtScale>& scales);
/// Prints a line for each view, and their mean.
void print_evaluation(std::FILE* out, const Evaluation& evaluation);
/// Prints in a line how far depths are off; nothing where none was measured.
void print_depth(std::FILE* out, const Evaluation& evaluation);
/// Prints a line for each scale: the means over its views.
void print_evaluation(std::FILE* out, const std::vector<AtScale>& scales);

/// A row for each view, and their means.
Table evaluation_table(const Evaluation& evaluation);
/// A row for each scale: the means over its views.
Table evaluation_table(const std::vector<AtScale>& scales);

// The cameras with which a run ended, where it refined them.

/// Takes the cameras of the same names from the cameras.json of the scene's run, at the sizes of
/// these views, and says so in a note. Does nothing where the run refined none. Throws Error where
/// the file is not one that a run leaves.
void take_trained_cameras(const std::filesystem::path& scene, std::vector<View>& views);

}  // namespace darb
