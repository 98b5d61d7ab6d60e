// SPDX-License-Identifier: MIT
// PSNR and SSIM on the CPU, as papers on splatting report them.
#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <string>

#include "engine/core/image.h"

namespace darb {

/// Both images must have the same size; values are clamped to [0, 1] first. Of 4 channels only the
/// first three count, so composite over a background before.

/// 10 log10(1 / mean squared error) in dB over all pixels and channels; infinity for equal images.
double psnr(const ImageF& image, const ImageF& truth);

/// Wang et al. 2004 as in 3DGS: window 11, sigma 1.5, C1 1e-4, C2 9e-4, zero padding, mean over
/// pixels and channels.
double ssim(const ImageF& image, const ImageF& truth, int threads = 2);

/// Maps [0, 255] to [0, 1].
ImageF to_float(const ImageU8& image);

// Compares a rendered view with its photo: both composited, quantised to 8 bits, and measured.

/// Error of a rendered depth against the measured one, over the pixels that have a measurement and
/// that splats cover to at least half.
struct DepthError {
    double mean_m = 0, median_m = 0;  // absolute difference, metres
};

struct ViewMetrics {
    std::string name;
    double psnr_db = 0, ssim = 0;
    bool in_arc = false;                   // View::in_arc; the caller sets it
    std::optional<DepthError> depth = {};  // the caller sets it, too
    std::optional<double> flip = {};       // and this: FLIP, where it was asked for
};

/// The photo as float RGB (value / 255), composited with straight alpha over a background.
ImageF composite(const ImageU8& photo, const glm::vec3& background);
/// Clamped to [0, 1] and rounded to 8 bits.
ImageU8 to_8bit(const ImageF& image);
/// photo | render | absolute error x 4, side by side.
ImageU8 side_by_side(const ImageF& photo, const ImageF& render);

/// PSNR and SSIM of a render, clamped to [0, 1], against the photo over the same background. Where
/// alpha is a mask, pixels with alpha below 128 are black in both images, as they are in the loss,
/// and PSNR covers only the other pixels; both figures are NaN where all pixels are masked. PSNR is
/// 100 dB at most.
ViewMetrics compare_view(const std::string& name, const ImageF& render, const ImageU8& photo,
                         const glm::vec3& background, bool alpha_is_mask = false);

/// FLIP of the same two pictures, the mean over the pixels that count; NaN where none does.
double flip_of_view(const ImageF& render, const ImageU8& photo, const glm::vec3& background,
                    bool alpha_is_mask = false);

/// rendered: [H][W][2] depth and opacity in world units, as Renderer::render_depth gives them;
/// measured: [H][W] from load_depth; scale: world units a metre. Returns nothing where no pixel
/// counts.
std::optional<DepthError> compare_depth(const ImageF& rendered, const ImageF& measured,
                                        double scale);

}  // namespace darb
