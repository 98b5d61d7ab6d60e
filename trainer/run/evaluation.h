// SPDX-License-Identifier: MIT
// Held-out views: their metrics, and their pictures beside the photos.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/compare_view.h"
#include "engine/data/dataset.h"
#include "trainer/step/trainer.h"

namespace darb {

struct ArcMeans {  // over the views of an arc that was held out
    std::size_t views = 0;
    double psnr_db = 0, ssim = 0;
};

struct Evaluation {
    int iteration = 0;
    double seconds = 0;  // training time, without evaluations
    std::uint32_t splats = 0;
    std::vector<ViewMetrics> views;
    double psnr_db = 0, ssim = 0;  // means over the views; but for an arc, where others are there
    std::optional<ArcMeans> arc;   // where others are there
    std::optional<DepthError> depth;  // means over the views that have one
};

/// Means of the views, those of an arc apart where others are there, too; but for views that are
/// masked throughout: NaN where all are.
void take_means(Evaluation& evaluation);

/// Only views, means: iteration, seconds and splats are the caller's. photos: all views' in order.
Evaluation evaluate_held_out(Trainer& trainer, const Dataset& dataset,
                             const std::vector<ImageU8>& photos);

/// photo | render | absolute error x 4, a PNG a held-out view, in the order of the views.
std::vector<std::filesystem::path> write_side_by_side(Trainer& trainer, const Dataset& dataset,
                                                      const std::vector<ImageU8>& photos,
                                                      const std::filesystem::path& folder);

}  // namespace darb
