// SPDX-License-Identifier: MIT
#include "viewer/view_camera.h"

#include <algorithm>
#include <cmath>

#include "engine/render/renderer.h"
#include "engine/scene/edit_splats.h"

namespace darb {

namespace {
constexpr double kPickRadius = 8;     // px
constexpr float kPickLogit = -0.85f;  // an opacity of 0.3
}  // namespace

double fit_scale(const Camera& camera, int width, int height) {
    return std::min(double(width) / camera.width, double(height) / camera.height);
}

Camera fitted(const Camera& camera, const WindowArea& area) {
    const double s = fit_scale(camera, area.free_width(), area.free_height());
    Camera c = camera;
    c.fx *= s;
    c.fy *= s;
    c.cx = c.cx * s + area.left + 0.5 * (area.free_width() - s * camera.width);
    c.cy = c.cy * s + area.top + 0.5 * (area.free_height() - s * camera.height);
    c.width = area.width;
    c.height = area.height;
    return c;
}

Camera at_scale(const Camera& camera, double scale) {
    const auto px = [&](int full) {
        return std::max(1, static_cast<int>(std::lround(full * scale)));
    };
    return scale == 1 ? camera : resized(camera, px(camera.width), px(camera.height));
}

std::optional<glm::dvec3> pick(const SplatModel& m, const std::vector<std::uint8_t>& removed,
                               const Camera& camera, double x, double y) {
    std::optional<glm::dvec3> best;
    double best_depth = 0;
    for (size_t i = 0; i < m.size(); ++i) {
        if ((!removed.empty() && removed[i] != 0) || m.opacity_logit[i] < kPickLogit) continue;
        const glm::dvec3 world = position_of(m, i);
        const glm::dvec3 p = camera.rotation * world + camera.translation;
        if (p.z <= 0 || (best && p.z >= best_depth)) continue;
        const double dx = camera.fx * p.x / p.z + camera.cx - x;
        const double dy = camera.fy * p.y / p.z + camera.cy - y;
        if (dx * dx + dy * dy > kPickRadius * kPickRadius) continue;
        best = world;
        best_depth = p.z;
    }
    return best;
}

}  // namespace darb
