// How far pictures are from the truth: PSNR, largest error and 99.9th percentile over all values of
// all pictures.
#pragma once

#include <vector>

#include "engine/core/image.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct PictureError {
    double mse = 0;      // of values in [0, 1]
    double psnr_db = 0;  // 200 at most
    double largest = 0;
    double percentile = 0;  // 99.9 % of the values are at most this far
};

/// The same pictures in the same order, [H][W][3]; both are clamped to [0, 1] first, as a screen
/// shows them.
PictureError picture_error(const std::vector<ImageF>& pictures, const std::vector<ImageF>& truth);

/// The double-precision renderer at the most accurate settings; kernel, footprint and degree are
/// the model's. by_pixel: splats fully sorted at every pixel, else by the depth of their centres.
std::vector<ImageF> true_pictures(const SplatModel& model, const std::vector<Camera>& cameras,
                                  const glm::vec3& background, bool by_pixel);

}  // namespace darb
