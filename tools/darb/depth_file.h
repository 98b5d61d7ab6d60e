// Depth images beside the frames of darb render.
#pragma once

#include <filesystem>

#include "engine/core/image.h"

namespace darb {

/// depth: Renderer::render_depth. FRAME_depth.png in steps of `unit` world units, or
/// FRAME_depth.npy in world units.
void write_depth(const std::filesystem::path& frame, const ImageF& depth, bool npy, double unit);

}  // namespace darb
