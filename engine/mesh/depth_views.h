// SPDX-License-Identifier: MIT
// Depths of a scene's surface as several cameras see it: rendered, held on the host, and reduced to
// what other cameras confirm. They are what a surface is fused from.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/render/renderer.h"
#include "engine/scene/camera.h"
#include "shaders/shared/mesh_args.h"

namespace darb {

/// Called now and then with what is being done and its share, 0 to 1. It may throw, which ends the
/// work.
using MeshProgress = std::function<void(const char* what, double share)>;

struct DepthView {
    Camera camera;             // a pinhole, in the world
    std::vector<float> depth;  // [H][W] along the optical axis, world units; 0: no surface
    std::vector<std::uint32_t>
        colour;  // [H][W] RGBA, 8 bits each, red lowest; empty: not asked for
};

struct DepthViewOptions {
    DepthReading reading = DepthReading::front;
    float level = 0.5f;  // share of the light that is left at the surface
    float near_plane = static_cast<float>(NEAR_DEFAULT);
    bool colours = true;
};

/// One view a camera, at the camera's size. Lenses are left out: a surface needs no distorted
/// picture, and a pinhole's rays are straight.
std::vector<DepthView> render_depth_views(Renderer& renderer, const std::vector<Camera>& cameras,
                                          const DepthViewOptions& options,
                                          const MeshProgress& progress = {});

/// The AGREE_VIEWS other views that see most of what each view sees, from angles of about 12
/// degrees, the best first; fewer where fewer see anything of it.
std::vector<std::vector<std::size_t>> views_to_agree(const std::vector<DepthView>& views);

struct ConfirmedDepths {
    std::size_t pixels = 0, surfaces = 0, kept = 0;  // over all views
};
/// Sets depths to 0 that fewer than two of these other views confirm; one is enough where only one
/// looks there. origin: SplatModel::origin.
ConfirmedDepths keep_confirmed(Device& device, std::vector<DepthView>& views,
                               const glm::dvec3& origin, const MeshProgress& progress = {});

/// Views on the device, as many at a time as fit.
class ViewBatch {
  public:
    /// pixels: the most that a batch holds; a larger view is a batch of its own.
    ViewBatch(Device& device, const std::vector<DepthView>& views, const glm::dvec3& origin,
              std::uint64_t pixels, bool colours);
    /// Puts views [first, ...) there, in order, and returns one past the last.
    std::size_t load(std::size_t first);
    /// Puts these views there, which must fit.
    void load(const std::vector<std::size_t>& chosen);
    const Buffer& views() const { return view_buffer_; }
    const Buffer& depths() const { return depths_; }
    const Buffer& colours() const { return colours_; }
    static std::uint64_t device_bytes(std::uint64_t pixels, std::size_t views, bool colours);

  private:
    const std::vector<DepthView>* views_;
    glm::dvec3 origin_;
    std::uint64_t pixels_;
    Buffer view_buffer_, depths_, colours_;
};

}  // namespace darb
