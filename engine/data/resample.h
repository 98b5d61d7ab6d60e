// Pixel work on the way from a decoded photo to a training photo; all on RGBA with straight alpha.
#pragma once

#include "engine/core/image.h"
#include "engine/data/dataset.h"

namespace darb {

/// 1, 3 or 4 channels to 4; alpha 255 where there was none.
ImageU8 to_rgba(ImageU8 image);

/// Multiplies alpha by the mask's first channel / 255 (by 0 or 1 where its largest value is 1); by
/// its alpha where that varies, and by both where its colours are black and white. A mask of
/// another size is sampled at the nearest pixel. Colour where alpha becomes 0 stays.
void apply_mask(ImageU8& rgba, const ImageU8& mask);

/// Mean over each target pixel's area, in premultiplied alpha, rounded to nearest. Sizes may be
/// any; width and height at most those of the source.
ImageU8 box_downscale(const ImageU8& rgba, int width, int height);

/// The pinhole that load_photo turns a lens into, at full size, and whether some of its pixels are
/// seen by no photo pixel. A lens without distortion keeps its size and intrinsics. Pose is
/// identity.
struct UndistortedFrame {
    Camera camera;
    bool has_gaps = false;
};
UndistortedFrame undistorted_frame(const LensModel& lens, const std::string& where);

/// Bilinear in premultiplied alpha; alpha 0 where the lens sees nothing.
ImageU8 undistort(const ImageU8& rgba, const LensModel& lens, const Camera& camera);

}  // namespace darb
