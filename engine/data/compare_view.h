// A picture of a view beside its photo: composited, in 8 bits, measured.
#pragma once

#include <glm/vec3.hpp>
#include <string>

#include "engine/core/image.h"

namespace darb {

struct ViewMetrics {
    std::string name;
    double psnr_db = 0, ssim = 0;
    bool in_arc = false;  // View::in_arc, which the caller sets
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

}  // namespace darb
