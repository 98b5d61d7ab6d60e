// The order of splats in a file whose chunks of consecutive splats share their bounds
// (compressed_ply.h): those of a chunk lie close together. Morton order of 10 bits an axis, as
// splat-transform has it, so that its files written again keep their chunks; and what would coarsen
// the chunks of others, splats far off, comes last.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

/// Of splats with finite positions; chunk: splats.
std::vector<std::uint32_t> chunk_order(const SplatModel& model, std::size_t chunk);

}  // namespace darb
