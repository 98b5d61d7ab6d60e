// SPDX-License-Identifier: MIT
#include "viewer/surface_probe.h"

#include <algorithm>
#include <cmath>

#include "shaders/shared/limits.h"

namespace darb {

namespace {

// A pixel's tile is seen far from the principal point, so that must stay where it is.
ForwardOptions of_probe(ForwardOptions options) {
    options.effects.off_centre = true;
    options.effects.lens = false;
    options.depth_order = DEPTH_ORDER_CENTRE;
    options.storage = STORAGE_FLOAT32;
    options.store_for_backward = false;
    return options;
}

}  // namespace

SurfaceProbe::SurfaceProbe(Device& device, ForwardOptions options)
    : options_(of_probe(std::move(options))),
      buffers_(device, options_),
      forward_(device, options_),
      median_(device, options_, usual_reading(options_.kernel)),
      exchange_(device),
      commands_(device) {}

bool SurfaceProbe::is_for(int kernel, const ProjectionEffects& effects) const {
    ForwardOptions asked = options_;
    asked.effects = effects;
    return options_.kernel == kernel && options_.effects == of_probe(asked).effects;
}

std::optional<glm::dvec3> SurfaceProbe::find(const GpuSplats& splats, const Camera& camera,
                                             float near_plane, const glm::dvec2& px) {
    constexpr int kMiddle = TILE_SIZE / 2;
    const glm::dvec2 pixel = glm::floor(px);
    Camera tile = camera;
    tile.width = tile.height = TILE_SIZE;
    tile.cx = camera.cx - pixel.x + kMiddle;
    tile.cy = camera.cy - pixel.y + kMiddle;
    tile.lens = {};
    const FrameView view = list_tile(splats, tile, near_plane);
    commands_.begin();
    median_.record(commands_, splats, view, buffers_.frame(), exchange_.status().longest_list);
    commands_.submit_and_wait();
    const auto depths = median_.depth().download<glm::vec2>(TILE_SIZE * TILE_SIZE);
    const double depth = double{depths[kMiddle * TILE_SIZE + kMiddle].x};
    if (!(depth > 0)) return {};
    const glm::dvec3 ray((pixel.x + 0.5 - camera.cx) / camera.fx,
                         (pixel.y + 0.5 - camera.cy) / camera.fy, 1);
    return glm::transpose(camera.rotation) * (depth * ray - camera.translation);
}

FrameView SurfaceProbe::list_tile(const GpuSplats& splats, const Camera& tile, float near_plane) {
    const FrameView view{camera_data(tile, splats.origin(), near_plane), &exchange_.cameras(), 0, 0,
                         glm::vec3(0.0f)};
    buffers_.reserve(splats.count(),
                     std::max(buffers_.size().intersections, splats.count() / 4 + 1024), TILE_SIZE,
                     TILE_SIZE);
    do {
        commands_.begin();
        exchange_.send(commands_, view.camera);
        forward_.record_intersections(commands_, splats, view, buffers_.frame());
        exchange_.fetch(commands_, buffers_.frame().counters.status);
        commands_.submit_and_wait();
    } while (buffers_.make_room(exchange_.status()));
    return view;
}

}  // namespace darb
