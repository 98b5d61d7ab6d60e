#include "trainer/depth_loss.h"

#include "engine/primitives/groups.h"
#include "shaders/shared/loss_args.h"
#include "shaders/shared/render_args.h"

namespace darb {

DepthLoss::DepthLoss(Device& device, bool use_alpha, bool exposure)
    : pipeline_(
          device, "depth_loss",
          {{"THREADS", SPLAT_GROUP}, {"USE_ALPHA", use_alpha ? 1 : 0}, {"ADD", exposure ? 1 : 0}}) {
}

void DepthLoss::record(Commands& commands, const DepthLossBuffers& buffers, std::uint32_t pixels,
                       float weight, double usual) {
    commands.pass("depth loss");
    const Groups g = groups_for(pixels);
    const auto scale = static_cast<float>(weight / (static_cast<double>(pixels) * usual));
    commands.dispatch(pipeline_, gpu::DepthLossArgs{pixels, buffers.measured ? 1u : 0u, scale},
                      {buffers.image, buffers.transmittance, buffers.photo, buffers.d_image}, g.x,
                      g.y);
}

}  // namespace darb
