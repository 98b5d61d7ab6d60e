// SPDX-License-Identifier: MIT
// IterateAverage: the mean of the splats over iterations of a run (Polyak and Juditsky 1992). Steps
// that are too large to settle scatter around where they lead; their mean does not.
#pragma once

#include <array>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/raster/gpu_splats.h"

namespace darb {

class IterateAverage {
  public:
    /// Holds no memory of splats before the first add().
    explicit IterateAverage(Device& device);

    /// Adds the splats as they are now; their count and degree may change only after clear(). The
    /// queue must be idle. Throws Error where the device has no room for the first mean; call
    /// clear() then.
    void add(const GpuSplats& splats);
    /// How many calls of add() the mean is over.
    std::uint32_t count() const { return count_; }
    /// Swaps the parameters and their mean; a second call swaps them back. Does nothing where
    /// count() is 0.
    void swap(GpuSplats& splats);
    void clear();

    /// [attribute][N stride], or empty; a checkpoint holds this and count().
    std::vector<std::vector<float>> state(const GpuSplats& splats) const;
    /// splats: with the same count and degree.
    void restore(const std::vector<std::vector<float>>& state, std::uint32_t count,
                 const GpuSplats& splats);

  private:
    Device* device_;
    Commands commands_;
    Pipeline average_;
    std::uint32_t count_ = 0;
    std::array<Buffer, kAttributeCount> mean_;
};

}  // namespace darb
