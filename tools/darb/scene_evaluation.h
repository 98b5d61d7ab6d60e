// SPDX-License-Identifier: MIT
// A scene's pictures measured against photos, at the photos' size and at others.
#pragma once

#include <cstdio>
#include <glm/vec3.hpp>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/plan/accuracy.h"
#include "engine/plan/effect_plan.h"
#include "engine/ranks/ranks.h"
#include "engine/scene/splat_model.h"
#include "trainer/run/run.h"

namespace darb {

struct SceneEvaluation {
    Accuracy accuracy = preset_accuracy(kBalanced);
    EffectChoice effects;
    glm::vec3 background{0.0f};
    bool fit_exposure = false;   // fit each picture's to its photo first
    bool align_cameras = false;  // align each camera to its photo first, by CameraAlignment
    bool alpha_is_mask = false;  // as the data set has it
    double depth_scale = 1;      // likewise; measured depths are compared where views have them
    Ranks* ranks = nullptr;      // ranks that measure views in turn; null: this process does all
};

/// What a model's pictures of these views have, and their means; views: at the size to measure at.
/// Throws Error where a picture is too large for the device.
Evaluation evaluate_scene(Device& device, const SplatModel& model, std::vector<View> views,
                          const SceneEvaluation& options);

/// An evaluation at one of the scales.
struct AtScale {
    double scale = 1;
    int width = 0, height = 0;  // px, of the first view
    Evaluation evaluation;
};

/// {"mean": ..., "views": ...}, or {"scales": [the same with scale, width and height]}.
/// The same at several sizes: scales[i] is of sizes[i].
std::vector<AtScale> evaluate_scales(Device& device, const SplatModel& model,
                                     const std::vector<double>& scales,
                                     const std::vector<std::vector<View>>& sizes,
                                     const SceneEvaluation& options);

nlohmann::json evaluation_json(const Evaluation& evaluation);
nlohmann::json evaluation_json(const std::vector<AtScale>& scales);
/// A line a view, and their mean.
void print_evaluation(std::FILE* out, const Evaluation& evaluation);
/// How far depths are off, a line; nothing where none was measured.
void print_depth(std::FILE* out, const Evaluation& evaluation);
/// A line a scale: the means over its views.
void print_evaluation(std::FILE* out, const std::vector<AtScale>& scales);

}  // namespace darb
