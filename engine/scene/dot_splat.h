// .splat, the format of antimatter15's viewer: 32 bytes a splat and no header.
//   position 3 x float32, standard deviation 3 x float32, r g b opacity 4 x uint8,
//   rotation w x y z 4 x uint8 (q * 128 + 128)
// No harmonics above the constant one, no kernel, no render mode.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

/// Whether the bytes look like .splat, which has nothing to know it by: a length that 32 divides,
/// and in the first thousand records finite positions and scales and rotations of length 1.
bool looks_like_dot_splat(std::span<const std::byte> file);

/// Splats with NaN, infinity or a negative scale are dropped, *dropped is their count. Scale 0
/// becomes the smallest that is told apart from it. Throws Error where 32 does not divide the
/// length. logarithms: its scales are those of the lengths, as the user says.
SplatModel parse_dot_splat(std::span<const std::byte> file, const std::string& where,
                           std::size_t* dropped = nullptr, bool logarithms = false);

/// Positions and scales are exact to float32; the error of opacity and of a colour within [0, 1]
/// is at most 1/510, of a quaternion's component 1/128 and its normalisation. Harmonics of higher
/// degree are left out.
std::vector<std::byte> encode_dot_splat(const SplatModel& model);

}  // namespace darb
