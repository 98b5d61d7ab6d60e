// Backward: from dL/dimage to the splats' parameters, recorded after Forward::record of the same
// frame. blend_backward -> project_backward, which ends in the Adam step or in stored gradients.
#pragma once

#include <array>
#include <limits>
#include <map>

#include "engine/raster/blend_backward.h"
#include "engine/raster/gpu_splats.h"
#include "shaders/shared/optim_args.h"

namespace darb {

/// Rates of one step, per attribute; rates already divided by 1 - beta1^t.
struct AdamStep {
    float position = 0, scale = 0, rotation = 0, opacity = 0, sh_dc = 0, sh_rest = 0;
    float inverse_sqrt_correction2 = 1;
    // Weights of the mean opacity and the mean scale in the loss; of the splats that the frame
    // shows, or of all.
    float opacity_weight = 0, scale_weight = 0;
    bool regularise_unseen = false;
    float largest_log_scale = std::numeric_limits<float>::max();  // none grows beyond it
    float clearance = 0;  // world: splats nearer to the camera fade
    // Harmonics above the first band make a step in every so many iterations, of the mean gradient
    // of these; more than 1 takes splats that hold such means.
    int rest_every = 1;
    int rest = REST_EACH;  // what that is in this iteration, REST_*
};
/// rates: plain learning rates; t: the number of this step, from 1.
AdamStep adam_step(const AdamStep& rates, int t);

enum class BackwardResult {
    update,          // Adam
    store_gradient,  // gradients in the first moments' place; parameters untouched
};

class Backward {
  public:
    Backward(Device& device, const ForwardOptions& options, BackwardResult result);

    /// Buffers for so many splats and intersections, records as BlendBackward::reserve says: never
    /// shrinks, 0 of any asks for no more. Where there are more splats, gradient_sum() starts at 0.
    void reserve(std::uint32_t splats, std::uint32_t intersections, std::uint32_t records = 0);
    /// Device memory beside a frame of this size.
    static FrameBytes device_bytes(const FrameSize& size);

    /// d_image: float [3][H][W]. splats must have moments.
    void record(Commands& commands, const FrameView& view, const Frame& frame, GpuSplats& splats,
                const Buffer& d_image, const AdamStep& step);

    /// The backward blend alone: the intersections' sums of alpha T times the planes of `image`,
    /// float [3][H][W], where record() leaves those of dL/dcolour. Recorded between Forward::record
    /// and record(); where lists take several dispatches it leaves another final transmittance.
    void record_shares(Commands& commands, const FrameView& view, const Frame& frame,
                       const Buffer& image);
    /// Its partials, [K][8] of each intersection; the last three are those of the colour.
    const BlendBackward& blend() const { return blend_; }

    /// [N][2]: sum of |dL/dmean| in NDC units and the number of frames that saw the splat.
    Buffer& gradient_sum() { return gradient_sum_; }
    void clear_gradient_sum(Commands& commands) { commands.fill(gradient_sum_, 0); }

  private:
    static BufferList<Backward> splat_buffers(std::uint64_t splats);
    Pipeline& project_pipeline(int sh_degree, int sh_stored, int rest);

    Device* device_;
    ForwardOptions options_;
    BackwardResult result_;
    BlendBackward blend_;
    std::map<std::array<int, 3>, Pipeline> project_;  // by degree, that of the buffers, REST_*
    std::uint32_t splat_capacity_ = 0;
    Buffer gradient_sum_;
};

}  // namespace darb
