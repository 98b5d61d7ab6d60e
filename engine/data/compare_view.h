// A picture of a view beside its photo: composited, in 8 bits, measured.
#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <string>

#include "engine/core/image.h"

namespace darb {

/// Of the depth of a picture from the measured one, over the pixels that were measured and of which
/// the splats cover at least half.
struct DepthError {
    double mean_m = 0, median_m = 0;  // of the absolute difference
};

struct ViewMetrics {
    std::string name;
    double psnr_db = 0, ssim = 0;
    bool in_arc = false;                   // View::in_arc, which the caller sets
    std::optional<DepthError> depth = {};  // likewise
};

/// The photo as float RGB over a background, value / 255, straight alpha composited.
ImageF composite(const ImageU8& photo, const glm::vec3& background);
/// Clamped to [0, 1] and rounded to 8 bits.
ImageU8 to_8bit(const ImageF& image);
/// photo | render | absolute error x 4; the photo composited.
ImageU8 side_by_side(const ImageF& photo, const ImageF& render);

/// PSNR and SSIM of a render, clamped to [0, 1], against the photo over the same background. Where
/// alpha is a mask, pixels below 128 are black in both, as the loss sees them, and PSNR is over the
/// others alone; both are NaN where all are masked. PSNR is 100 dB at most.
ViewMetrics compare_view(const std::string& name, const ImageF& render, const ImageU8& photo,
                         const glm::vec3& background, bool alpha_is_mask = false);

/// rendered: [H][W][2] depth and opacity, as Renderer::render_depth gives them, world units;
/// measured: [H][W] of load_depth; scale: world units a metre. Nothing where no pixel counts.
std::optional<DepthError> compare_depth(const ImageF& rendered, const ImageF& measured,
                                        double scale);

}  // namespace darb
