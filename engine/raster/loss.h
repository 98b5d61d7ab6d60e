// SPDX-License-Identifier: MIT
// Loss: (1 - lambda) L1 + lambda (1 - SSIM) of a rendered image against a photo, and its gradient,
// in one pass over the image (shaders/loss/loss.comp), or in two by tiles, as the device's tuning
// says, and one over the partial sums.
// Source: 3DGS equation 7; window 11, sigma 1.5, zero padding, C1 1e-4, C2 9e-4, means over 3 H W.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/gpu/pipeline.h"
#include "shaders/shared/loss_args.h"

namespace darb {

struct LossOptions {
    // false: the photo is opaque, whatever its alpha says; the rest is not used.
    bool use_alpha = true;
    // false: the photo is y = rgb * alpha + background * (1 - alpha).
    // true: alpha is a mask. Where it is below 128, both images count as 0 (as the zero padding
    // around the image does), the gradient is 0 and L1 and squared error are left out of the sums;
    // means still divide by 3 H W.
    bool use_mask = false;
    // For strips: columns per thread and rows per strip; 0: what suits the device. The gradient
    // does not depend on them, the sums do in their last bit.
    int columns = 0, rows = 0;
};

/// What a Loss reads and writes.
struct LossBuffers {
    BufferRange image;         // float [3][H][W]
    BufferRange ground_truth;  // [H][W] R | G << 8 | B << 16 | A << 24, straight alpha
    BufferRange d_image;       // float [3][H][W]: dL/dimage, every pixel is written
    BufferRange results;       // gpu::LossResult[], of which result_index is written
    std::uint32_t result_index = 0;
};

class Loss {
  public:
    /// For images up to max_width x max_height px. Throws Error where the loss goes by strips and
    /// the device's subgroups have fewer than 4 lanes.
    Loss(Device& device, int max_width, int max_height, const LossOptions& options = {});

    /// Device memory of a Loss made with these arguments.
    static std::uint64_t device_bytes(const Device& device, int max_width, int max_height,
                                      const LossOptions& options = {});

    /// Two or three dispatches under the pass "loss". Where x = y the gradient of L1 is 0.
    /// Bit-equal from run to run on one device.
    void record(Commands& commands, const LossBuffers& buffers, int width, int height,
                const glm::vec3& background, float lambda = 0.2f);

    /// The loss itself, from the result of record().
    static double value(const gpu::LossResult& result, double lambda = 0.2) {
        return (1 - lambda) * result.l1 + lambda * (1 - result.ssim);
    }

  private:
    static BufferList<Loss> buffers(const Device& device, int max_width, int max_height,
                                    const LossOptions& options);
    void make_strips(Device& device, const LossOptions& options, SpecConstants constants);
    gpu::LossArgs strips(int width, int height) const;
    void record_strips(Commands& commands, const LossBuffers& buffers, const gpu::LossArgs& args);
    void record_tiles(Commands& commands, const LossBuffers& buffers, const gpu::LossArgs& args);

    int max_width_, max_height_;
    LossWay way_;
    int lanes_ = 0, columns_ = 0, threads_ = 0;
    int wanted_works_ = 0;   // strips that keep the device busy
    int rows_ = 0;           // rows of a strip; 0: by wanted_works_
    Pipeline loss_;          // for strips
    Pipeline maps_, slope_;  // for tiles
    Pipeline sum_;
    Buffer partial_;
    Buffer map_values_;  // [3][H][W][3] of tiles
};

}  // namespace darb
