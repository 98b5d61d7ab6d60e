// SPDX-License-Identifier: MIT
// Splats in the order of a space-filling curve: those that lie beside each other in the scene lie
// beside each other in memory, so that what a view does not see comes in long runs. The sort is
// stable and the grid is the caller's: the order repeats. A picture changes by it only where
// splats have the same depth.
#pragma once

#include <glm/vec3.hpp>

#include "trainer/growth/density_control.h"

namespace darb {

/// A cube of 1024 cells a side, in the splats' coordinates.
struct MortonGrid {
    glm::vec3 centre{0};
    float half_side = 1;
};

class MortonOrder {
  public:
    explicit MortonOrder(Device& device);

    /// Parameters and moments into the order of the curve; splats of one cell keep theirs. What is
    /// per splat beside them is the caller's to clear or make anew. The queue must be idle. Takes
    /// less for a moment than a round of density control.
    void run(GpuSplats& splats, DensityControl& density, const MortonGrid& grid);

  private:
    Device* device_;
    Commands commands_;
    Pipeline key_, sources_;
};

}  // namespace darb
