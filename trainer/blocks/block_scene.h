// SPDX-License-Identifier: MIT
// What a block is trained on and what is left of it: its photos, the splats that it begins with
// and its frozen surroundings, the cut to its cell, and the joined scene.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/scene/splat_model.h"
#include "trainer/blocks/partition.h"
#include "trainer/options/options.h"

namespace darb {

/// The data set with only these of its views, all to train on, and with all of its points.
Dataset block_dataset(const Dataset& whole, const std::vector<std::size_t>& views);

struct BlockStart {
    SplatModel model;          // the surroundings first
    std::uint32_t frozen = 0;  // how many of them, a multiple of GpuSplats::kFrozenUnit
};

/// The region that a block trains: its cell with the margin, except for cells that are done.
struct BlockRegion {
    const Partition& cells;
    std::size_t cell;
    std::vector<bool> done;  // [cell]
    bool holds(const glm::dvec3& world) const;
};

/// A start from the coarse model: its splats in the region, to be trained, and the others that
/// any of the cameras may see, frozen. Where the margin lies in cells that are done, `beside`, what
/// they ended with, replaces the coarse splats. The few least opaque of the coarse ones around are
/// left out that would not fill a unit. sh_degree: that of the result, where bands beyond the
/// coarse model's are 0.
BlockStart block_start(const SplatModel& coarse, const BlockRegion& region,
                       const SplatModel& beside, const std::vector<View>& views, int sh_degree);

/// Appends splats to train, made from the data set's points in the region as a run of the whole
/// begins with them; where there would be more than `most` splats in all, from a random part of the
/// points.
void add_points(const Dataset& whole, const BlockRegion& region, const TrainOptions& options,
                std::uint32_t most, BlockStart& start);

/// Splats behind the first `frozen` whose centres lie in the cell.
SplatModel cut_to_cell(const SplatModel& trained, std::uint32_t frozen, const Partition& cells,
                       std::size_t cell);
/// The splats whose centres lie in the cell or its margin.
SplatModel cut_to_margin(SplatModel model, const Cell& cell, const GroundPlane& plane);

/// All splats of the parts, in their order, with the highest of their degrees of colour.
SplatModel join_parts(const std::vector<SplatModel>& parts);

}  // namespace darb
