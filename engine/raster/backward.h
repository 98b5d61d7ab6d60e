// SPDX-License-Identifier: MIT
// Backward: from dL/dimage to the splats' parameters, recorded after Forward::record of the same
// frame. blend_backward -> project_backward, which ends in the Adam step or in buffers of
// gradients.
#pragma once

#include <array>
#include <map>
#include <vector>

#include "engine/raster/adam.h"
#include "engine/raster/blend_backward.h"
#include "engine/raster/gpu_splats.h"
#include "engine/raster/gradient_buffers.h"
#include "shaders/shared/optim_args.h"

namespace darb {

/// Where gradients go.
struct GradientTarget {
    GradientBuffers& to;
    bool add = false;  // add to what it holds, else replace it
    /// float [N][CAMERA_SHARES], what shaders/backward/camera_gradient.glsl leaves; only where
    /// options.camera_gradient asks for it, and without add.
    const Buffer* camera = nullptr;
};

class Backward {
  public:
    Backward(Device& device, const ForwardOptions& options);

    /// As Forward::set_kernel; buffers and what they hold stay.
    void set_kernel(int kernel);

    /// Makes buffers for so many splats, intersections and records (see BlendBackward::reserve).
    /// Never shrinks; 0 asks for no more of that kind. Where there are more splats, gradient_sum()
    /// starts at 0.
    void reserve(std::uint32_t splats, std::uint32_t intersections, std::uint32_t records = 0);
    /// Device memory beside a frame of this size.
    static FrameBytes device_bytes(const FrameSize& size);

    /// The gradients of one view, and at once its Adam step. d_image: float [3][H][W]. splats must
    /// have moments; what the view shows of each is added to gradient_sum().
    void record(Commands& commands, const FrameView& view, const Frame& frame, GpuSplats& splats,
                const Buffer& d_image, const AdamStep& step);
    /// The same into `target`; splats stay as they are and need no moments.
    void record_gradients(Commands& commands, const FrameView& view, const Frame& frame,
                          const GpuSplats& splats, const Buffer& d_image,
                          const GradientTarget& target);

    /// [N][2]: sum of |dL/dmean| in NDC units and the number of frames that saw the splat.
    Buffer& gradient_sum() { return gradient_sum_; }
    void clear_gradient_sum(Commands& commands) { commands.fill(gradient_sum_, 0); }

  private:
    static BufferList<Backward> splat_buffers(std::uint64_t splats);
    Pipeline& project_pipeline(int sh_degree, int sh_stored, int update, int rest, bool flatness);
    /// What project_backward binds beside the frame and the splats.
    struct ProjectBuffers {
        std::vector<BufferRange> state;  // moments or gradients
        const Buffer& sums;              // sums of the gradients of means
        BufferRange rest_sum;
    };
    /// Adds up the partials of large splats, by the device's tuning.
    void record_chunks(Commands& commands, const Frame& frame);
    void record_project(Commands& commands, const FrameView& view, const Frame& frame,
                        const GpuSplats& splats, Pipeline& pipeline,
                        const gpu::ProjectBackwardArgs& args, const ProjectBuffers& extra);

    Device* device_;
    ForwardOptions options_;
    BlendBackward blend_;
    bool sums_by_chunks_;  // by the device's tuning
    Pipeline chunks_;      // made when needed
    // Keyed by the degree in use, that of the buffers, UPDATE_* and REST_*.
    std::map<std::array<int, 5>, Pipeline> project_;
    std::uint32_t splat_capacity_ = 0;
    Buffer gradient_sum_;
};

}  // namespace darb
