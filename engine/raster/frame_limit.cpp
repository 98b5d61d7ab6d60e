#include "engine/raster/frame_limit.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/core/error.h"

namespace darb {

std::uint64_t max_frame_pixels(const Device& device, std::uint64_t planes) {
    return device.info().max_storage_buffer_bytes / (planes * sizeof(float));
}

void check_frame(const Device& device, int width, int height, const std::string& camera,
                 std::uint64_t planes) {
    const std::uint64_t pixels = std::uint64_t(width) * height,
                        most = max_frame_pixels(device, planes);
    if (pixels <= most) return;
    // As a width, which means the same whatever -r was; less what the height is rounded up by.
    const int fitting = static_cast<int>(std::sqrt(double(most) * width / height)) - 2;
    throw NoRoom(
        camera.empty() ? "frame" : fmt::format("camera \"{}\"", camera),
        fmt::format("a frame of {} x {} px is too large: {} holds at most {} pixels a frame", width,
                    height, device.info().name, most),
        fmt::format("{} {} (a width in px), or choose another device (darb devices).",
                    camera.empty() ? "Use at most" : "Use -r", fitting));
}

}  // namespace darb
