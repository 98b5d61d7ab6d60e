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

    /// Takes in the splats as they are, of the count and degree of those before or after clear().
    /// The queue must be idle. Throws Error where the device has no room for the first; to be
    /// cleared then.
    void add(const GpuSplats& splats);
    /// How many it is the mean of.
    std::uint32_t count() const { return count_; }
    /// The parameters and their mean change places; a second time, back. Nothing where count() is
    /// 0.
    void swap(GpuSplats& splats);
    void clear();

    /// [attribute][N stride], or empty; with count() what a checkpoint holds.
    std::vector<std::vector<float>> state(const GpuSplats& splats) const;
    /// splats: of the same count and degree.
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
