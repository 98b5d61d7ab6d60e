// SPDX-License-Identifier: MIT
// SurfaceProbe: where the surface of splats is in one pixel of a picture, by their median depth. It
// draws nothing but the tile around the pixel.
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "engine/gpu/commands.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/gpu_splats.h"
#include "engine/raster/median_depth.h"
#include "engine/render/renderer.h"
#include "engine/scene/camera.h"

namespace darb {

class SurfaceProbe {
  public:
    /// options: those of the pictures; principal points are taken as they are, and there is no
    /// lens. Throws Error.
    SurfaceProbe(Device& device, ForwardOptions options);

    /// Whether it asks splats of this kernel with these effects.
    bool is_for(int kernel, const ProjectionEffects& effects) const;
    /// The point in the pixel that holds `px` of the camera's picture, world; nothing where more
    /// than half of the light is left behind all splats. Waits. Throws Error.
    std::optional<glm::dvec3> find(const GpuSplats& splats, const Camera& camera, float near_plane,
                                   const glm::dvec2& px);

  private:
    FrameView list_tile(const GpuSplats& splats, const Camera& tile, float near_plane);

    ForwardOptions options_;
    FrameBuffers buffers_;
    Forward forward_;
    MedianDepth median_;
    FrameExchange exchange_;
    Commands commands_;
};

}  // namespace darb
