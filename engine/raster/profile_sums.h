// SPDX-License-Identifier: MIT
// ProfileSums: what the gradient of a learned profile is made of, summed over the frames between
// two changes of the profile. LearnedProfile::gradient makes the gradient of it.
#pragma once

#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/raster/forward_options.h"
#include "engine/raster/frame.h"
#include "engine/raster/frame_view.h"
#include "shaders/shared/profile_args.h"

namespace darb {

class ProfileSums {
  public:
    /// options: those of the forward pass, with a kernel in polynomials of u = 1 - q/R^2. The sums
    /// begin at 0.
    ProfileSums(Device& device, const ForwardOptions& options);

    /// For frames of another such kernel from now on. The queue must be idle.
    void set_kernel(int kernel);
    /// Makes buffers for frames of this size; never shrinks. The queue must be idle.
    void reserve(const FrameSize& size);
    /// Device memory beside a frame of this size.
    static FrameBytes device_bytes(const FrameSize& size);

    /// Adds the sums of this frame; one that overflowed adds nothing. To be recorded before
    /// Backward::record of the same frame. d_image: as there.
    void record(Commands& commands, const FrameView& view, const Frame& frame,
                const Buffer& d_image);

    // The queue must be idle.
    std::vector<float> read() const;
    void write(const std::vector<float>& sums);  // [PROFILE_SUMS]
    void clear() { write(std::vector<float>(PROFILE_SUMS, 0.0f)); }

  private:
    static BufferList<ProfileSums> frame_buffers(const FrameSize& size);
    void make_pipeline(bool segmented);

    Device* device_;
    ForwardOptions options_;
    bool segmented_ = false;
    Pipeline gradient_, add_;
    Buffer rows_, transmittance_, behind_, sums_;
};

}  // namespace darb
