// The walk of the reference with the settings of a device walk: in double, the truth; and the same
// code in float, to show what float alone costs.
#pragma once

#include "engine/check/device_walk.h"

namespace darb::check {

struct WalkTruth {
    std::vector<double> image;                           // [H][W][3]
    std::array<std::vector<double>, kAttributeCount> d;  // empty without d_image
    std::vector<double> mean_gradient_ndc;
    size_t visible = 0;
};

/// The origin is taken out of the camera, as the device does.
WalkTruth walk_in_double(const SplatModel& model, const Camera& camera,
                         const Image<double>& d_image, const WalkSettings& settings);
WalkTruth walk_in_float(const SplatModel& model, const Camera& camera, const Image<double>& d_image,
                        const WalkSettings& settings);

/// [H][W][3] in [-1, 1], rounded to float.
Image<double> random_weights(const Camera& camera);

}  // namespace darb::check
