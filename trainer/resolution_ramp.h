// The resolution ramp: the first iterations see smaller photos, through cameras that follow, and
// cost the less. Schedule::ramp_steps says which.
#pragma once

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/scene/camera.h"
#include "shaders/shared/render_args.h"

namespace darb {

/// The camera of a photo whose sides are divided and rounded: it sees the same.
Camera divided(const Camera& camera, double divisor);

class ResolutionRamp {
  public:
    explicit ResolutionRamp(Device& device);

    /// A smaller photo: area means, colours weighted by alpha. photo: [H][W] R G B A of `camera`
    /// and, where it is twice as large, float [H][W] measured depths, of which the nearest measured
    /// one is taken.
    Buffer downsample(const Buffer& photo, const Camera& camera, const Camera& smaller,
                      Memory memory = Memory::device);

  private:
    Device* device_;
    Commands commands_;
    Pipeline pipeline_, depths_;
};

}  // namespace darb
