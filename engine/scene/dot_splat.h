// SPDX-License-Identifier: MIT
// .splat, the format of antimatter15's viewer: 32 bytes a splat and no header.
//   position 3 x float32, standard deviation 3 x float32, r g b opacity 4 x uint8,
//   rotation w x y z 4 x uint8 (q * 128 + 128)
// No harmonics above the constant one, no kernel, no render mode.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "engine/kernels/kernel_profile.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Whether the bytes look like .splat. The format has no signature, so this checks that 32 divides
/// the length, and that the first thousand records have finite positions and scales, and
/// rotations of length 1.
bool looks_like_dot_splat(std::span<const std::byte> file);

/// Drops splats with NaN, infinity or a negative scale, and counts them in *dropped. Scale 0
/// becomes the smallest positive scale. logarithms: the user says that the file stores log scales.
/// Throws Error where 32 does not divide the length.
SplatModel parse_dot_splat(std::span<const std::byte> file, const std::string& where,
                           std::size_t* dropped = nullptr, bool logarithms = false);

/// Positions and scales are exact to float32. The error of opacity and of a colour within [0, 1] is
/// at most 1/510, of a quaternion's component 1/128 before normalisation. Harmonics above degree 0
/// are left out.
std::vector<std::byte> encode_dot_splat(const SplatModel& model);

// Converts a scene with another kernel to Gaussians, for viewers that know only these.

/// Replaces scales and opacities by those of the Gaussian nearest to the scene's kernel (least
/// squares over the image plane; kernel_profile.h); everything else stays. Opacities are
/// limited to 0.999. A Gaussian scene is returned unchanged. *fit: what was used; for a kernel with
/// shapes, the means over the splats, weighted by opacity.
SplatModel as_gaussians(const SplatModel& model, bool keep_opacity,
                        GaussianEquivalent* fit = nullptr);

}  // namespace darb
