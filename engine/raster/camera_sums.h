// SPDX-License-Identifier: MIT
// CameraSums: dL/d(camera) of a view, added up over its splats on the device: what a step of a
// camera is made of. Backward::record_gradients leaves the splats' shares here.
#pragma once

#include <array>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "shaders/shared/optim_args.h"

namespace darb {

class CameraSums {
  public:
    explicit CameraSums(Device& device);

    /// Makes buffers for so many splats; never shrinks. Throws Error where the device binds no
    /// more.
    void reserve(std::uint32_t splats);
    static std::uint64_t device_bytes(std::uint64_t splats);

    /// The buffer to pass as GradientTarget::camera.
    Buffer& shares() { return shares_; }
    /// To be called after Backward::record_gradients. d_position: float [N][3].
    void record(Commands& commands, std::uint32_t splats, const Buffer& d_position);
    /// The sums of record(), once the queue is idle: shaders/shared/optim_args.h has the order.
    std::array<double, CAMERA_SUMS> read() const;

  private:
    static BufferList<CameraSums> buffers(std::uint64_t splats);

    Device* device_;
    Pipeline add_;
    std::uint32_t capacity_ = 0;
    Buffer shares_, sums_;
};

}  // namespace darb
