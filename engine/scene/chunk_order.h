// SPDX-License-Identifier: MIT
// The order of splats in a file in which chunks of consecutive splats share their bounds
// (compressed_ply.h): splats of a chunk lie close together. It is the Morton order with 10 bits per
// axis that splat-transform uses, so that its files keep their chunks when they are written again.
// Splats far off, which would coarsen other splats' chunks, come last.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

/// model: finite positions; chunk: number of splats in one.
std::vector<std::uint32_t> chunk_order(const SplatModel& model, std::size_t chunk);

}  // namespace darb
