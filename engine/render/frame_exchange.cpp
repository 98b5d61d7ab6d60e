#include "engine/render/frame_exchange.h"

#include <cstring>

namespace darb {

FrameExchange::FrameExchange(Device& device)
    : cameras_(device, "cameras", sizeof(gpu::CameraData)),
      camera_host_(device, "camera of the host", sizeof(gpu::CameraData), Memory::host),
      status_host_(device, "status result", sizeof(gpu::FrameStatus), Memory::host) {}

void FrameExchange::send(Commands& commands, const gpu::CameraData& camera) {
    std::memcpy(camera_host_.mapped(), &camera, sizeof camera);
    commands.copy(camera_host_, cameras_, sizeof camera);
}

void FrameExchange::fetch(Commands& commands, const Buffer& status) {
    commands.copy(status, status_host_, sizeof(gpu::FrameStatus));
}

gpu::FrameStatus FrameExchange::status() const {
    gpu::FrameStatus result{};
    std::memcpy(&result, status_host_.mapped(), sizeof result);
    return result;
}

}  // namespace darb
