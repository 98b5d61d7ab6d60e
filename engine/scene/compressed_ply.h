// SPDX-License-Identifier: MIT
// PlayCanvas's compressed PLY, as SuperSplat and splat-transform write it. Element chunk: bounds of
// position, log scale and colour (the last may be missing) of 256 splats each; element vertex: four
// uint32 a splat, relative to its chunk; element sh (may be missing): one byte a coefficient.
//   packed_position, packed_scale   11, 10, 11 bits for x, y, z
//   packed_rotation                 2 bits: the largest of w x y z; 10 bits for each of the others
//   packed_color                    8 bits for r, g, b and opacity
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/ply.h"
#include "engine/scene/ply_table.h"
#include "engine/scene/splat_model.h"

namespace darb {

bool is_compressed_ply(const PlyHeader& header);

/// Same contract as parse_ply in ply.h, which calls it.
SplatModel parse_compressed_ply(std::span<const std::byte> file, const PlyHeader& header,
                                const std::string& where, PlyFacts* facts,
                                const ReadProgress& progress = {});

/// Nearby splats share a chunk, even where a scene has splats far off. In a chunk, the error of a
/// position is at most the chunk's size / 4094 (in y: 2046), of a log scale its range / 4094
/// (2046), of a colour its range / 510, of opacity 1/510, of a quaternion's component 7e-4, and of
/// a harmonic 1/32 within [-4, 4], beyond which it is clamped. Comments keep kernel, footprint and
/// render mode.
std::vector<std::byte> encode_compressed_ply(const SplatModel& model);
/// Warnings about harmonics that are clamped, and splats that move by more than their largest
/// standard deviation, one sentence each. Takes as long as encode_compressed_ply.
std::vector<std::string> compressed_ply_losses(const SplatModel& model);

}  // namespace darb
