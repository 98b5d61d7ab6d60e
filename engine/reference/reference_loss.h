// SPDX-License-Identifier: MIT
// The training loss of 3DGS, (1 - lambda) L1 + lambda (1 - SSIM), value and gradient, and the
// distortion of depths. SSIM after
// Wang et al. 2004: Gaussian window 11, sigma 1.5, zero padding, data range 1.
#pragma once

#include <vector>

#include "engine/core/image.h"
#include "engine/reference/blend.h"

namespace darb::reference {

struct LossSettings {
    double lambda = 0.2;  // share of 1 - SSIM
    double c1 = 1e-4;     // (0.01)^2
    double c2 = 9e-4;     // (0.03)^2
};

template <class T>
struct LossResult {
    double loss = 0;
    double l1 = 0;     // weighted mean of |image - truth|
    double ssim = 0;   // weighted mean of SSIM; 1 for equal images without weight
    Image<T> d_image;  // [H][W][3] dL/d(image); sign(0) is 0
};

/// image [H][W][3], any values; truth [H][W][3] in [0, 1], composited by the caller where the photo
/// has an alpha channel. weight [H][W][1], or empty for 1: multiplies both terms of its pixel. All
/// means divide by H W 3, whatever the weights. There must be at least one pixel.
template <class T>
LossResult<T> loss(const Image<T>& image, const Image<T>& truth, const LossSettings& settings = {},
                   const Image<T>& weight = {});

struct DistortionResult {
    double loss = 0;
    Image<double> d_alpha;  // [H][W][1] dL/d(1 - transmittance)
    Image<double> d_depth;  // [H][W][2] dL/d(depth), dL/d(square)
};

/// The distortion of depths: weight times the mean over pixels of p / (p + k^2), k being
/// DISTORTION_WIDTH and p the sum over pairs of splats of w_i w_j ((z_i - z_j) / D)^2, with w the
/// weights in the pixel, z the depths, and D = sum w z / sum w held constant. images: a picture's,
/// with its squares. left_out: [H W] pixels that do not count, or empty.
DistortionResult distortion(const BlendImages<double>& images, double weight,
                            const std::vector<bool>& left_out = {});

/// truth / 255.
template <class T>
Image<T> to_unit_range(const ImageU8& photo);

}  // namespace darb::reference
