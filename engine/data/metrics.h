// SPDX-License-Identifier: MIT
// PSNR and SSIM on the CPU, as papers on splatting report them.
#pragma once

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

}  // namespace darb
