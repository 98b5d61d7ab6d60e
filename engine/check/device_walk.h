// SPDX-License-Identifier: MIT
// One forward and backward pass of a scene on the device, read back: the device's version of the
// walk that engine/reference computes in double.
#pragma once

#include <array>
#include <vector>

#include "engine/core/image.h"
#include "engine/raster/backward.h"
#include "engine/raster/gpu_splats.h"

namespace darb::check {

struct DeviceWalk {
    gpu::FrameStatus status{};
    ImageF image;                                       // [H][W][3]
    std::array<std::vector<float>, kAttributeCount> d;  // dL/d(attribute), laid out as in
                                                        // SplatModel
    std::vector<float> mean_gradient_ndc;               // [N] |dL/dmean|
    std::vector<std::uint32_t> intersection_count;      // [N] tiles that list the splat; 0: culled
};

struct WalkSettings {
    int evaluation = EVALUATION_POLYNOMIAL;
    int polynomial_degree = 5;
    int storage = STORAGE_FLOAT32;
    int depth_order = DEPTH_ORDER_CENTRE;  // DEPTH_ORDER_PIXEL: forward only
    int projection = PROJECTION_JACOBIAN;
    int arithmetic = ARITHMETIC_FLOAT32;
    float alpha_cutoff = static_cast<float>(ALPHA_CUTOFF_DEFAULT);
    float transmittance_stop = static_cast<float>(TRANSMITTANCE_STOP);
    glm::vec3 background{0.0f};
    int sh_degree = 3;                      // degree in use, at most the model's
    std::uint32_t intersections = 100'000;  // initial capacity; it grows
};

ForwardOptions forward_options(const SplatModel& model, const WalkSettings& settings);

/// Converts interleaved [H][W][3] to planes [3][H][W].
std::vector<float> to_planes(const Image<double>& image);

/// Runs the forward pass, and the backward pass where d_image [H][W][3] is not empty. A frame that
/// did not fit its buffers is repeated.
DeviceWalk walk_on_device(Device& device, const SplatModel& model, const Camera& camera,
                          const Image<double>& d_image, const WalkSettings& settings);

// The reference's walk with the settings of a device walk: in double, as the truth; and the same
// code in float, to show what float alone costs.

struct WalkTruth {
    std::vector<double> image;                           // [H][W][3]
    std::array<std::vector<double>, kAttributeCount> d;  // empty without d_image
    std::vector<double> mean_gradient_ndc;
    size_t visible = 0;
};

/// The origin is subtracted from the camera, as on the device.
WalkTruth walk_in_double(const SplatModel& model, const Camera& camera,
                         const Image<double>& d_image, const WalkSettings& settings);
WalkTruth walk_in_float(const SplatModel& model, const Camera& camera, const Image<double>& d_image,
                        const WalkSettings& settings);

/// Random values [H][W][3] in [-1, 1], rounded to float.
Image<double> random_weights(const Camera& camera);

}  // namespace darb::check
