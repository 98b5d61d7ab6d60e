// FrameExchange: what the host gives to a frame and takes from it, copied by the commands of that
// frame. An upload and a download would each wait for the queue and, on a device with memory of its
// own, make a staging buffer.
#pragma once

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "shaders/shared/render_args.h"

namespace darb {

class FrameExchange {
  public:
    explicit FrameExchange(Device& device);

    /// First of a frame; no earlier one may still run. The camera goes to cameras(), at index 0.
    void send(Commands& commands, const gpu::CameraData& camera);
    const Buffer& cameras() const { return cameras_; }

    /// Last of a frame: its gpu::FrameStatus, which status() has once the frame was waited for.
    void fetch(Commands& commands, const Buffer& status);
    gpu::FrameStatus status() const;

  private:
    Buffer cameras_, camera_host_, status_host_;
};

}  // namespace darb
