// Held-out views: their metrics, and their pictures beside the photos.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "trainer/run.h"
#include "trainer/trainer.h"

namespace darb {

/// The photo as float RGB over a background, value / 255, straight alpha composited.
ImageF composite(const ImageU8& photo, const glm::vec3& background);
/// Clamped to [0, 1] and rounded to 8 bits.
ImageU8 to_8bit(const ImageF& image);

/// PSNR and SSIM of a render, clamped to [0, 1], against the photo over the same background. Where
/// alpha is a mask, pixels below 128 are black in both, as the loss sees them, and PSNR is over the
/// others alone; both are NaN where all are masked. PSNR is 100 dB at most.
ViewMetrics compare_view(const std::string& name, const ImageF& render, const ImageU8& photo,
                         const glm::vec3& background, bool alpha_is_mask = false);
/// Mean of the views into evaluation.psnr_db and ssim, but for those that are masked throughout:
/// NaN where all are.
void take_means(Evaluation& evaluation);

/// Only views, means: iteration, seconds and splats are the caller's. photos: all views' in order.
Evaluation evaluate_held_out(Trainer& trainer, const Dataset& dataset,
                             const std::vector<ImageU8>& photos);

/// photo | render | absolute error x 4, a PNG a held-out view, in the order of the views.
std::vector<std::filesystem::path> write_side_by_side(Trainer& trainer, const Dataset& dataset,
                                                      const std::vector<ImageU8>& photos,
                                                      const std::filesystem::path& folder);

}  // namespace darb
