// Upsample: a picture rendered at half the size, interpolated to the size that is shown.
#pragma once

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/scene/camera.h"

namespace darb {

/// The same view at another size.
Camera resized(const Camera& camera, int width, int height);
/// With half the pixels each way, rounded up.
Camera halved(const Camera& camera);

class Upsample {
  public:
    explicit Upsample(Device& device);
    /// Records the pass. image: float [3][H][W] of `rendered`. Returns one of the size of `shown`,
    /// there until the next call.
    const Buffer& record(Commands& commands, const Buffer& image, const Camera& rendered,
                         const Camera& shown);

  private:
    Device* device_;
    Pipeline pipeline_;
    Buffer image_;
};

}  // namespace darb
