// SPDX-License-Identifier: MIT
// What accuracy costs in time: every accuracy setting alone, and combinations of them, measured on
// one model, one set of views and one device.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/gpu/device.h"
#include "engine/plan/accuracy.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "tools/cost/plan_subject.h"

namespace darb {

struct PictureError {
    double mse = 0;      // for values in [0, 1]
    double psnr_db = 0;  // 200 at most
    double largest = 0;
    double percentile = 0;  // 99.9 % of the values are at most this far
};

/// pictures and truth must correspond, [H][W][3] each; both are clamped to [0, 1] first, as on a
/// screen.
PictureError picture_error(const std::vector<ImageF>& pictures, const std::vector<ImageF>& truth);

/// Pictures by the double-precision renderer at the most accurate settings; kernel, footprint and
/// degree are the model's. by_pixel: sort splats at every pixel, rather than by the depth of their
/// centres.
std::vector<ImageF> true_pictures(const SplatModel& model, const std::vector<Camera>& cameras,
                                  const glm::vec3& background, bool by_pixel);

struct CostPlan {
    int least_repeats = 3, most_repeats = 25;
    double seconds = 25;  // per round (alone, combinations), after the warm-up
    size_t combinations = 16;
};

/// Median and quartiles over the repeats.
struct Spread {
    double median = 0, low = 0, high = 0;
};
Spread spread_of(std::vector<double> samples);

struct CostRow {
    Accuracy accuracy;
    std::string name;  // accuracy_text
    int setting = -1;  // the setting that differs from balanced; -1: none or several
    Spread ms;         // per frame, mean over the views: the sum of its passes
    std::vector<std::pair<std::string, Spread>> passes;
    PictureError error;                               // against the truth in the file's depth order
    PictureError error_by_pixel;                      // against the truth sorted at every pixel
    std::optional<double> photo_psnr_db, photo_ssim;  // means over the views
    bool same_as_balanced = false;                    // bit for bit
    bool on_front = false, on_photo_front = false;
};

struct CostResult {
    std::vector<CostRow> rows;  // balanced first, then each choice alone, presets, combinations
    std::vector<std::string> view_names;
    std::uint64_t pixels = 0;  // in all views
    size_t splats = 0;
    std::string device, driver, kernel, footprint;
    int repeats = 0;           // in the round with fewer
    double drift = 1;          // how balanced's time changed: round of combinations over round of
                               // single settings
    size_t group = 0;          // rows measured side by side
    double truth_seconds = 0;  // time to render the truth in both orders
};

/// progress: called now and then with a line for the user.
CostResult measure_cost(Device& device, const SplatModel& model, const CostViews& views,
                        const glm::vec3& background, const CostPlan& plan,
                        const std::function<void(const std::string&)>& progress);

/// The combinations that should be on the front according to the single measurements: times
/// multiply, squared errors add. At most `most`, spread evenly along the front, without those that
/// rows already hold.
std::vector<Accuracy> promising_combinations(const std::vector<CostRow>& rows, size_t most);

/// Marks the rows that no other row beats in both time and error.
void mark_fronts(std::vector<CostRow>& rows);

/// Answers as sentences: "fastest within 0.1 dB: ...".
std::vector<std::string> cost_answers(const CostResult& result);

}  // namespace darb
