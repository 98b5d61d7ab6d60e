// The resolution ramp: the first iterations see smaller photos, through cameras that follow, and
// cost the less. A quarter of the sides in the first tenth of a run, half up to 3/10 of it, then
// all; no step brings the longest side of the photos below 100 px.
#pragma once

#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/scene/camera.h"
#include "shaders/shared/render_args.h"
#include "trainer/options.h"

namespace darb {

struct RampStep {
    int divisor;     // of the photos' sides
    int iterations;  // how many see photos of this size
};

/// The steps that begin a run, smallest photos first; none without options.resolution_ramp.
/// longest_side: of all photos, px.
std::vector<RampStep> ramp_steps(const TrainOptions& options, int longest_side);

/// What the sides of the photos are divided by in an iteration (from 1): 1 after the last step.
int ramp_divisor(const TrainOptions& options, int iteration, int longest_side);

/// The camera of a photo whose sides are divided and rounded: it sees the same.
Camera divided(const Camera& camera, int divisor);

class ResolutionRamp {
  public:
    explicit ResolutionRamp(Device& device);

    /// A smaller photo: area means, colours weighted by alpha. photo: [H][W] R G B A of `camera`.
    Buffer downsample(const Buffer& photo, const Camera& camera, const Camera& smaller);

  private:
    Device* device_;
    Commands commands_;
    Pipeline pipeline_;
};

}  // namespace darb
