// SPDX-License-Identifier: MIT
// Which splats float in space that a scene's cameras look through.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/render/renderer.h"
#include "engine/scene/camera.h"
#include "engine/scene/clutter.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct FreeSpaceOptions {
    /// A surface is where this share of a pixel's light is taken, 0 to 1. What takes less on its
    /// way may float before it.
    double taken = 0.5;
    /// A splat floats before a surface if it ends before this share of its depth.
    double before = 0.9;
    /// It is in free space if it floats in so many views, and in at least four times as many as see
    /// it at a surface.
    std::uint32_t least_views = 3;
    int width = 640;  // px; wider cameras are scaled down
    float near_plane = static_cast<float>(NEAR_DEFAULT);
};

/// At most `most` of the cameras, evenly chosen: so many are asked.
std::vector<Camera> evenly_chosen(const std::vector<Camera>& cameras, std::size_t most = 48);
/// The camera without its lens, and no wider than `width` px.
Camera pinhole_at_most(Camera camera, int width);

/// Asks one camera after another.
class FreeSpace {
  public:
    /// The model must stay where it is and as it is.
    explicit FreeSpace(const SplatModel& model, const FreeSpaceOptions& options = {});

    /// Draws what the camera sees, and its depth. The renderer holds the model; a lens is left out.
    void ask(Renderer& renderer, const Camera& camera);
    /// The splats that are in free space by what was asked so far.
    SplatSet splats() const;

  private:
    struct Votes {
        std::uint32_t floating = 0, at_surface = 0;
    };
    void vote(const Camera& camera, const ImageF& depth);

    const SplatModel* model_;
    FreeSpaceOptions options_;
    std::vector<double> sizes_;  // [N] largest standard deviations
    std::vector<Votes> votes_;   // [N]
};

}  // namespace darb
