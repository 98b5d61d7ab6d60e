// SPDX-License-Identifier: MIT
#include "engine/render/free_space.h"

#include <algorithm>
#include <cmath>

#include "engine/core/on_threads.h"
#include "engine/scene/edit_splats.h"

namespace darb {

namespace {

constexpr std::size_t kSplatsAtATime = 4096;  // splats of a thread at a time
constexpr double kEnds = 2;                 // standard deviations from a splat's centre to its end
constexpr std::uint32_t kTimesAsOften = 4;  // floating, for each view that sees it at a surface

}  // namespace

std::vector<Camera> evenly_chosen(const std::vector<Camera>& cameras, std::size_t most) {
    std::vector<Camera> chosen;
    const std::size_t count = std::min(most, cameras.size());
    for (std::size_t i = 0; i < count; ++i) chosen.push_back(cameras[i * cameras.size() / count]);
    return chosen;
}

Camera pinhole_at_most(Camera camera, int width) {
    camera.lens = {};
    camera.shutter = {};
    if (camera.width <= width) return camera;
    return resized(camera, width, std::max(1, camera.height * width / camera.width));
}

FreeSpace::FreeSpace(const SplatModel& model, const FreeSpaceOptions& options)
    : model_(&model), options_(options), sizes_(largest_deviations(model)), votes_(model.size()) {}

void FreeSpace::ask(Renderer& renderer, const Camera& camera) {
    const Camera pinhole = pinhole_at_most(camera, options_.width);
    renderer.draw(pinhole, glm::vec3(0.0f), 0, options_.near_plane);
    vote(pinhole,
         renderer.render_depth(DepthReading::plane, static_cast<float>(1 - options_.taken)));
}

void FreeSpace::vote(const Camera& c, const ImageF& depth) {
    in_pieces(model_->size(), kSplatsAtATime, [&](std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i) {
            const glm::dvec3 q = c.rotation * position_of(*model_, i) + c.translation;
            if (!(q.z > 0)) continue;
            const double x = c.fx * q.x / q.z + c.cx, y = c.fy * q.y / q.z + c.cy;
            if (!(x >= 0 && y >= 0 && x < c.width && y < c.height)) continue;
            const double surface =
                depth.data[2 * (std::size_t(y) * std::size_t(c.width) + std::size_t(x))];
            if (!(surface > 0)) continue;
            const double extent = kEnds * sizes_[i];
            if (q.z + extent < options_.before * surface)
                ++votes_[i].floating;
            else if (q.z - extent < surface / options_.before)
                ++votes_[i].at_surface;
        }
    });
}

SplatSet FreeSpace::splats() const {
    SplatSet set(votes_.size(), 0);
    for (std::size_t i = 0; i < set.size(); ++i)
        set[i] = votes_[i].floating >= options_.least_views &&
                         votes_[i].floating >= kTimesAsOften * votes_[i].at_surface
                     ? 1
                     : 0;
    return set;
}

}  // namespace darb
