// SPDX-License-Identifier: MIT
// FrameBuffers: owns the memory of a frame and decides how it grows. Nothing is read back inside a
// frame: one that needs more than there is raises a flag, the buffers grow, and it is done again.
#pragma once

#include <functional>

#include "engine/gpu/buffer.h"
#include "engine/raster/forward_options.h"
#include "engine/raster/frame.h"

namespace darb {

class FrameBuffers {
  public:
    FrameBuffers(Device& device, const ForwardOptions& options);

    Frame& frame() { return frame_; }
    const Frame& frame() const { return frame_; }
    const FrameSize& size() const { return frame_.size; }

    /// Makes the buffers fit: never shrinks. intersections: a guess, as a frame that needs more
    /// says so. The queue must be idle.
    void reserve(std::uint32_t splats, std::uint32_t intersections, int width, int height);
    /// To be called with a frame's status after it. Returns false where the frame is whole; else
    /// makes room for what it wanted, half as many intersections again where memory allows it, and
    /// clears the status; the frame must then be recorded again. Throws Error where it can never
    /// fit. The queue must be idle.
    /// make_other_buffers: called with the new capacity in size(), before the frame is done again,
    /// for what others hold of each intersection; where it throws, the capacity becomes what the
    /// frame wanted and no more, and it is called again.
    bool make_room(const gpu::FrameStatus& status,
                   const std::function<void()>& make_other_buffers = {});
    /// Decides by a frame's counters how the next one is emitted, where the options leave it to
    /// them; make_room calls it. The queue may be busy.
    void note_status(const gpu::FrameStatus& status);
    /// Sets the overflow flag and all counters to zero. The queue must be idle.
    void clear_status();

    /// Device memory of a frame of this size.
    static FrameBytes device_bytes(const Device& device, const ForwardOptions& options,
                                   const FrameSize& size);
    /// The most intersections that this device's buffers and bindings allow, with its backward
    /// blend or with another.
    static std::uint32_t max_intersections(const Device& device);
    static std::uint32_t max_intersections(const Device& device, BackwardBlend backward);
    /// Intersections per checkpoint; 0: frames with these options have none.
    static std::uint32_t bucket(const Device& device, const ForwardOptions& options);

  private:
    void reserve_splats(std::uint32_t splats);
    void reserve_intersections(std::uint32_t intersections);
    void reserve_image(int width, int height);
    void make_tile_sort();
    void make_huge_buffers();
    bool within_budget(std::uint32_t intersections) const;
    void grow(std::uint32_t wanted, std::uint32_t most,
              const std::function<void()>& make_other_buffers);
    void segment_lists(std::uint32_t longest_list);

    Device* device_;
    ForwardOptions options_;
    Frame frame_;
};

}  // namespace darb
