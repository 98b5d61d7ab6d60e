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

/// The data set with these of its views alone, all to train on, and all of its points.
Dataset block_dataset(const Dataset& whole, const std::vector<std::size_t>& views);

struct BlockStart {
    SplatModel model;          // the surroundings first
    std::uint32_t frozen = 0;  // how many of them, a multiple of GpuSplats::kFrozenUnit
};

/// What is trained of a block: its cell and the margin, but for cells that are done.
struct BlockRegion {
    const Partition& cells;
    std::size_t cell;
    std::vector<bool> done;  // [cell]
    bool holds(const glm::dvec3& world) const;
};

/// From the coarse model: its splats in the region, to train, and the others that one of the
/// cameras may see, frozen; in place of those in the margin of cells that are done `beside`, what
/// these have come to there. Of the coarse ones around, the few least opaque are left out that make
/// no whole unit. sh_degree: that of the model, whose further bands are 0.
BlockStart block_start(const SplatModel& coarse, const BlockRegion& region,
                       const SplatModel& beside, const std::vector<View>& views, int sh_degree);

/// Behind these, to train: splats of the data set's points in the region, as a run of the whole
/// begins with them; of more than leave `most` splats in all, a drawn part.
void add_points(const Dataset& whole, const BlockRegion& region, const TrainOptions& options,
                std::uint32_t most, BlockStart& start);

/// Splats behind the first `frozen` whose centres lie in the cell.
SplatModel cut_to_cell(const SplatModel& trained, std::uint32_t frozen, const Partition& cells,
                       std::size_t cell);
/// Those of them within the cell's margin.
SplatModel cut_to_margin(SplatModel model, const Cell& cell, const GroundPlane& plane);

/// All splats of the parts, in their order, with the highest of their degrees of colour.
SplatModel join_parts(const std::vector<SplatModel>& parts);

}  // namespace darb
