// SPDX-License-Identifier: MIT
// Pixel operations that turn a decoded photo into a training photo, all on RGBA with straight
// alpha.
#pragma once

#include "engine/core/image.h"
#include "engine/data/dataset.h"

namespace darb {

/// Converts 1, 3 or 4 channels to 4; alpha is 255 where there was none.
ImageU8 to_rgba(ImageU8 image);

/// Multiplies alpha by the mask's first channel / 255 (by 0 or 1 where its largest value is 1); by
/// the mask's alpha instead where that varies, and by both where its colours are black and white. A
/// mask of another size is sampled at the nearest pixel. The colour stays where alpha becomes 0.
void apply_mask(ImageU8& rgba, const ImageU8& mask);

/// The mean over each target pixel's area, in premultiplied alpha, rounded to nearest. Any size is
/// allowed, but neither side may be larger than that of the source.
ImageU8 box_downscale(const ImageU8& rgba, int width, int height);

/// The pinhole that load_photo undistorts a lens to, at full size, and whether some of its pixels
/// are seen by no pixel of the photo. A lens without distortion keeps its size and intrinsics. The
/// pose is the identity.
struct UndistortedFrame {
    Camera camera;
    bool has_gaps = false;
};
UndistortedFrame undistorted_frame(const LensModel& lens, const std::string& where);

/// Resamples bilinearly in premultiplied alpha; alpha is 0 where the lens sees nothing.
ImageU8 undistort(const ImageU8& rgba, const LensModel& lens, const Camera& camera);

}  // namespace darb
