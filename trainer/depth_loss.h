// Measured depths in training: the absolute difference of rendered depths from them, beside the
// loss of the colours. shaders/loss/depth_loss.comp has the formula.
#pragma once

#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"

namespace darb {

/// What a DepthLoss reads and writes, of one view.
struct DepthLossBuffers {
    const Buffer& image;          // float [4][H W] of ForwardOptions::depth_sum
    const Buffer& transmittance;  // float [H W]
    const Buffer& photo;          // uint [H W] R G B A and, where it is measured, float [H W]
    const Buffer& d_image;        // float [5][H W]: the last two planes are written
    bool measured = false;
};

class DepthLoss {
  public:
    /// use_alpha: as in LossOptions. exposure: the plane of dL/d(1 - transmittance) holds what
    /// Exposure::record_backward left, which is added to.
    DepthLoss(Device& device, bool use_alpha, bool exposure);

    /// The gradient of weight times the mean over all pixels of |depth - measured| / usual, a pixel
    /// without a measured depth having none. usual: world units, what makes it free of the scene's
    /// units. Belongs to the pass "depth loss".
    void record(Commands& commands, const DepthLossBuffers& buffers, std::uint32_t pixels,
                float weight, double usual);

  private:
    Pipeline pipeline_;
};

}  // namespace darb
