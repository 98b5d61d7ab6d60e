// SPDX-License-Identifier: MIT
// Relocation: a round of density control and noise on the device. Dead splats move onto live ones,
// new ones grow there, and nearly transparent ones wander. Source: 3DGS-MCMC, arXiv 2404.09591,
// with the relocation of any kernel (engine/kernels/relocation_table.h).
#pragma once

#include <cstdint>
#include <span>

#include "trainer/growth/density_control.h"

namespace darb {

struct RelocationRound {
    float dead_opacity = 0;
    std::uint32_t grown = 0, seed = 0;
    std::span<const std::uint8_t> fixed = {};  // [N], 1 for splats that no other moves onto
};

class Relocation {
  public:
    /// The table of scales takes about 0.1 s, a second with a kernel that has shapes.
    Relocation(Device& device, int kernel, Footprint footprint);

    /// Another table, of a kernel that has shapes where the one before had. The queue must be idle.
    void set_kernel(int kernel, Footprint footprint);

    /// Device memory between rounds. A round takes a little less than one of DensityControl.
    static std::uint64_t device_bytes(int kernel);

    /// One round: splats of an opacity up to dead_opacity move onto live ones that are not fixed,
    /// drawn in proportion to their opacities, and `grown` more are drawn likewise; all that share
    /// a place take the opacity and scale by which the picture stays. Moments of the moved, the new
    /// and the drawn are zero. The queue must be idle. Without a live splat nothing happens. pruned
    /// counts the moved.
    DensityResult run(GpuSplats& splats, DensityControl& density, const RelocationRound& round);

    /// Recorded after the step of the optimiser: position += rate * gate * covariance * normal.
    /// status: gpu::FrameStatus of the frame; one that overflowed moves nothing.
    void record_noise(Commands& commands, GpuSplats& splats, const Buffer& status, float rate,
                      float dead_opacity, std::uint32_t seed);

  private:
    Device* device_;
    Commands commands_;
    Pipeline weight_, draw_, sources_, relocate_, noise_;
    Buffer table_;
};

}  // namespace darb
