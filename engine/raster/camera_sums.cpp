// SPDX-License-Identifier: MIT
#include "engine/raster/camera_sums.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"

namespace darb {

CameraSums::CameraSums(Device& device) : device_(&device), add_(device, "camera_sums", {}, false) {}

BufferList<CameraSums> CameraSums::buffers(std::uint64_t splats) {
    return {{&CameraSums::shares_, "camera shares",
             std::max<std::uint64_t>(splats, 1024) * CAMERA_SHARES * 4},
            {&CameraSums::sums_, "camera sums", CAMERA_SUM_GROUPS * CAMERA_SUMS * 4}};
}

std::uint64_t CameraSums::device_bytes(std::uint64_t splats) {
    return charged_bytes(buffers(splats));
}

void CameraSums::reserve(std::uint32_t splats) {
    if (splats <= capacity_ && capacity_ > 0) return;
    const std::uint64_t most = device_->info().max_storage_buffer_bytes / (CAMERA_SHARES * 4);
    if (splats > most)
        throw Error("gradient of the camera",
                    fmt::format("{} splats, this device binds room for {}", splats, most),
                    "Train fewer splats, with --max-splats, or leave the cameras as they are.");
    capacity_ = 0;
    make_buffers(*device_, *this, buffers(splats), "camera gradient");
    capacity_ = std::max(splats, 1024u);
}

// Groups that no splat has write zeros.
void CameraSums::record(Commands& commands, std::uint32_t splats, const Buffer& d_position) {
    commands.pass("camera sums");
    commands.dispatch(add_, gpu::CameraSumArgs{splats}, {shares_, d_position, sums_},
                      CAMERA_SUM_GROUPS);
}

std::array<double, CAMERA_SUMS> CameraSums::read() const {
    std::array<double, CAMERA_SUMS> sum{};
    const auto parts = sums_.download<float>(CAMERA_SUM_GROUPS * CAMERA_SUMS);
    for (std::size_t i = 0; i < parts.size(); ++i) sum[i % CAMERA_SUMS] += double(parts[i]);
    return sum;
}

}  // namespace darb
