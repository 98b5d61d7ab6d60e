// What the parts of a run in blocks are trained with.
#pragma once

#include "engine/data/dataset.h"
#include "trainer/blocks/partition.h"
#include "trainer/options.h"

namespace darb {

/// That all blocks together may come to: options.max_splats, or what a run of the whole is forecast
/// to.
std::uint32_t whole_splats(const Dataset& dataset, const TrainOptions& options);
/// Of the coarse model of so many.
std::uint32_t coarse_splats(std::uint32_t whole);
/// Half the iterations, no view-dependent colour, an eighth of the splats.
TrainOptions coarse_options(const Dataset& dataset, const TrainOptions& options);
/// Degrees of colour by the iteration, without a probe. Beside the frozen ones, the share of
/// options.max_splats that the cell with its margin has of the points; start: what the block begins
/// with, at least.
TrainOptions block_options(const TrainOptions& options, const CellCount& count, std::size_t points,
                           std::uint32_t frozen, std::uint32_t start);

}  // namespace darb
