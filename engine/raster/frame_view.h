// SPDX-License-Identifier: MIT
// FrameView: what a frame is drawn from, as the passes read it.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/device.h"
#include "engine/scene/camera.h"
#include "shaders/shared/limits.h"
#include "shaders/shared/render_args.h"

namespace darb {

/// A camera, on the host and on the device, and what is drawn through it.
struct FrameView {
    gpu::CameraData camera{};
    const Buffer* cameras = nullptr;  // gpu::CameraData[]: `camera` is the one at `index`
    std::uint32_t index = 0;
    int sh_degree = 0;  // degree of the colours, at most the splats'
    glm::vec3 background{0.0f};
};

/// A camera as the shaders read it. origin: SplatModel::origin, taken out of the pose in double.
gpu::CameraData camera_data(const Camera& camera, const glm::dvec3& origin,
                            float near_plane = static_cast<float>(NEAR_DEFAULT));

/// Cameras in a device buffer, in the order given.
Buffer upload_cameras(Device& device, const std::vector<gpu::CameraData>& cameras);

/// Tiles of an image.
std::uint32_t image_tiles(int width, int height);

// The size of a frame that a device can render: its picture, three floats a pixel, is one binding.

/// planes: floats per pixel of the picture or of its gradient.
std::uint64_t max_frame_pixels(const Device& device, std::uint64_t planes = 3);

/// Throws Error where a frame has more, naming a width that fits. camera: the name of its camera,
/// where that is known.
void check_frame(const Device& device, int width, int height, const std::string& camera = {},
                 std::uint64_t planes = 3);

}  // namespace darb
