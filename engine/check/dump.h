// SPDX-License-Identifier: MIT
// One view of a scene as arrays: the image, and the gradient of a fixed loss by every parameter
// that a PLY file stores, for comparison with any other implementation.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"

namespace darb::check {

/// Writes image.npy [H][W][3] (black background, not clamped), d_xyz.npy [N][3], d_f_dc.npy [N][3],
/// d_f_rest.npy [N][3 (C - 1)] in the file's channel-major order, d_opacity.npy [N] (logit),
/// d_scale.npy [N][3] (logarithm), d_rot.npy [N][4] (w x y z, as stored), all float32 from the
/// shaders: gradients of sum(image * w), w = linspace(0, 1) over the H W 3 values. N: the splats
/// that the reader keeps, in file order. Throws Error as write_file_atomic does.
void dump_from_device(Device& device, const SplatModel& model, const Camera& camera,
                      const std::filesystem::path& folder);
/// The names of these files.
std::vector<std::filesystem::path> dump_files(const std::filesystem::path& folder);
/// The same arrays in float64, from the reference.
void dump_from_reference(const SplatModel& model, const Camera& camera,
                         const std::filesystem::path& folder);

// NumPy's .npy files, version 1.0: an array of float32 or float64, little-endian, C order.

/// values.size() is the product of shape. Throws Error as write_file_atomic does.
void write_npy(const std::filesystem::path& path, const std::vector<size_t>& shape,
               std::span<const float> values);
void write_npy(const std::filesystem::path& path, const std::vector<size_t>& shape,
               std::span<const double> values);

}  // namespace darb::check
