// The size of a frame that a device can render: its picture, three floats a pixel, is one binding.
#pragma once

#include <cstdint>
#include <string>

#include "engine/gpu/device.h"

namespace darb {

/// planes: floats a pixel, of the picture or of its gradient.
std::uint64_t max_frame_pixels(const Device& device, std::uint64_t planes = 3);

/// Throws Error where a frame has more, with a width that fits. camera: whose frame it is,
/// where that is known.
void check_frame(const Device& device, int width, int height, const std::string& camera = {},
                 std::uint64_t planes = 3);

}  // namespace darb
