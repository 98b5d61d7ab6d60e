// SPDX-License-Identifier: MIT
// BlendBackward: from dL/dimage to sums over pixels for each intersection, by the method that
// the device's tuning says; recorded after Forward::record of the same frame.
#pragma once

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/raster/forward_options.h"
#include "engine/raster/frame.h"
#include "engine/raster/frame_view.h"

namespace darb {

class BlendBackward {
  public:
    /// options: those of the forward pass, with store_for_backward. The device's tuning must be the
    /// one that the forward pass was made with.
    BlendBackward(Device& device, const ForwardOptions& options);

    /// As Forward::set_kernel.
    void set_kernel(int kernel);

    /// Makes the outputs fit; never shrinks. The queue must be idle. records: those of the frame's
    /// checkpoints, for which record() makes room where nobody did.
    void reserve(std::uint32_t intersections, std::uint32_t records = 0);
    /// Device memory beside a frame of this size, once one was recorded.
    static FrameBytes device_bytes(const FrameSize& size);

    /// d_image: float [3][H][W]. Belongs to the current pass() of commands.
    void record(Commands& commands, const FrameView& view, const Frame& frame,
                const Buffer& d_image);

    /// What the buffers below can hold, by the device's bindings and its largest buffer.
    static std::uint64_t max_intersections(const Device& device);

    /// float [K][8], in the order of emission: the sums of shaders/backward/blend_backward.comp.
    /// Shaders bind PARTIAL_WINDOWS windows of it, as lib/partials.glsl says.
    const Buffer& partials() const { return partials_; }
    BufferRange partials(std::uint32_t window) const;
    std::uint32_t window_intersections() const { return window_intersections_; }
    const Buffer& rest() const { return rest_; }  // float [K], [K][2] with options.depth_sum
    /// float [K] for a kernel with shapes: sums of its derivative by the exponent; else one word.
    const Buffer& exponent() const { return exponent_; }

  private:
    static BufferList<BlendBackward> intersection_buffers(std::uint64_t intersections, bool shaped,
                                                          bool depth_sum);
    static BufferList<BlendBackward> segment_buffers(const FrameSize& size);
    static BufferList<BlendBackward> bucket_buffers(std::uint64_t records);
    void make_pipelines(bool segmented);
    void make_by_pixels(SpecConstants constants);
    void make_half(SpecConstants constants);
    void record_lists(Commands& commands, const Frame& frame, const Buffer& d_image,
                      gpu::BlendArgs args);
    void record_buckets(Commands& commands, const Frame& frame, const Buffer& d_image,
                        gpu::BlendArgs args);

    Device* device_;
    ForwardOptions options_;
    bool half_;  // in half precision: blend_backward_half.comp
    BackwardBlend method_;
    bool longest_first_;
    Pipeline blend_;                         // used by every method
    Pipeline bucket_tiles_, bucket_behind_;  // for buckets
    bool segmented_ = false;                 // whether the pipelines take segments
    Buffer behind_;                          // state of the pixels between their dispatches
    Buffer bucket_tile_, bucket_rest_;       // for buckets
    std::uint32_t capacity_ = 0, window_intersections_ = 0;
    Buffer partials_, rest_, exponent_;
};

}  // namespace darb
