#include "tools/darb/compare_scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/data/metrics.h"
#include "engine/render/renderer.h"
#include "engine/scene/edit_splats.h"

namespace darb {

namespace {

constexpr int kViews = 8, kWidth = 480, kHeight = 360;  // px
constexpr double kHalfWidth = 25 * std::numbers::pi / 180, kAbove = 20 * std::numbers::pi / 180;
constexpr double kEqualDb = 100;

struct Box {
    glm::dvec3 low{0.0}, high{0.0};
};

/// From the 1st to the 99th percentile of each axis, relative to the model's origin.
Box inner_box(const SplatModel& model) {
    Box box;
    std::vector<float> values(model.size());
    for (std::size_t axis = 0; axis < 3 && !values.empty(); ++axis) {
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = model.position[3 * i + axis];
        std::sort(values.begin(), values.end());
        const std::size_t rank = values.size() / 100;
        box.low[static_cast<int>(axis)] = values[rank];
        box.high[static_cast<int>(axis)] = values[values.size() - 1 - rank];
    }
    return box;
}

}  // namespace

std::vector<View> orbit_views(const SplatModel& model) {
    const Box box = inner_box(model);
    const glm::dvec3 middle = model.origin + 0.5 * (box.low + box.high);
    const double radius = std::max(0.5 * glm::length(box.high - box.low), 1e-3);
    const double distance = radius / std::sin(kHalfWidth * kHeight / kWidth);
    std::vector<View> views;
    for (int i = 0; i < kViews; ++i) {
        const double angle = 2 * std::numbers::pi * i / kViews;
        const glm::dvec3 out(std::cos(kAbove) * std::sin(angle), -std::sin(kAbove),
                             -std::cos(kAbove) * std::cos(angle));
        const glm::dvec3 forward = -out;
        const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), forward));
        const glm::dvec3 down = glm::cross(forward, right);
        View view;
        view.name = fmt::format("orbit_{}", i);
        view.camera.width = kWidth;
        view.camera.height = kHeight;
        view.camera.fx = view.camera.fy = kWidth / 2.0 / std::tan(kHalfWidth);
        view.camera.cx = kWidth / 2.0;
        view.camera.cy = kHeight / 2.0;
        view.camera.rotation = glm::transpose(glm::dmat3(right, down, forward));
        view.camera.translation = -(view.camera.rotation * (middle + distance * out));
        views.push_back(view);
    }
    return views;
}

SceneDifference compare_scenes(const SplatModel& scene, const SplatModel& other,
                               const std::vector<View>& views, const std::string& device) {
    DeviceOptions options;
    options.select = device;
    Device chosen(options);
    Renderer first(chosen, scene), second(chosen, other);
    SceneDifference difference{0, 1e9, ""};
    for (const View& view : views) {
        const double db =
            std::min(psnr(second.render(view.camera), first.render(view.camera)), kEqualDb);
        difference.mean_psnr_db += db / static_cast<double>(views.size());
        if (db >= difference.worst_psnr_db) continue;
        difference.worst_psnr_db = db;
        difference.worst_view = view.name;
    }
    return difference;
}

}  // namespace darb
