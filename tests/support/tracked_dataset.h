// SPDX-License-Identifier: MIT
// Cameras on a ring around points with tracks; and the same cameras disturbed.
#pragma once

#include <cmath>

#include "engine/core/rng.h"
#include "engine/data/track_adjustment.h"
#include "engine/reference/splats.h"
#include "engine/scene/pose_metric.h"

namespace darb::test {

inline Dataset tracked_dataset(int views = 8, int points = 200) {
    Dataset dataset;
    dataset.root = "tracked";
    for (int v = 0; v < views; ++v) {
        const double half_turn = 3.14159265358979 * v / views;
        View view;
        view.name = "view_" + std::to_string(v);
        view.camera.width = 200;
        view.camera.height = 150;
        view.camera.fx = view.camera.fy = 220;
        view.camera.cx = 100;
        view.camera.cy = 75;
        view.camera.rotation =
            reference::rotation_of(std::cos(half_turn), 0.05 * v, std::sin(half_turn), 0);
        view.camera.translation = {0, 0, 4};
        view.lens.model = "PINHOLE";
        view.lens.parameters = {220, 220, 100, 75};
        view.lens.width = 200;
        view.lens.height = 150;
        dataset.views.push_back(view);
    }
    Pcg32 rng(7);
    dataset.points.seen_begin.push_back(0);
    for (int p = 0; p < points; ++p) {
        glm::dvec3 x;
        for (int c = 0; c < 3; ++c) x[c] = rng.uniform(-0.8, 0.8);
        for (int c = 0; c < 3; ++c) {
            dataset.points.position.push_back(x[c]);
            dataset.points.colour.push_back(128);
        }
        for (int v = 0; v < views; ++v) {
            if ((v + p) % 3 == 0) continue;  // not every photo sees every point
            const glm::dvec2 at = pinhole_pixel(dataset.views[size_t(v)].camera, x);
            dataset.points.seen_by.push_back(static_cast<std::uint32_t>(v));
            dataset.points.seen_at.push_back(static_cast<float>(at.x / 200));
            dataset.points.seen_at.push_back(static_cast<float>(at.y / 150));
        }
        dataset.points.seen_begin.push_back(dataset.points.seen_by.size());
    }
    return dataset;
}

inline std::vector<glm::dvec3> places_of(const Dataset& dataset) {
    std::vector<glm::dvec3> places;
    for (size_t p = 0; p < dataset.points.size(); ++p)
        places.emplace_back(dataset.points.position[3 * p], dataset.points.position[3 * p + 1],
                            dataset.points.position[3 * p + 2]);
    return places;
}

/// Root mean square distance between the pixels at which two cameras see the places, px.
inline double shift_px(const Camera& a, const Camera& b, const std::vector<glm::dvec3>& places) {
    double sum = 0, count = 0;
    for (const glm::dvec3& x : places) {
        const glm::dvec2 d = pinhole_pixel(a, x) - pinhole_pixel(b, x);
        if (!std::isfinite(d.x + d.y)) continue;
        sum += glm::dot(d, d);
        ++count;
    }
    return std::sqrt(sum / count);
}

/// Shifts cameras by about `px` each, turning and moving them at random but not in common, so that
/// the scene as a whole stays.
inline void disturb(std::vector<View>& views, const std::vector<glm::dvec3>& places, double px,
                    std::uint64_t seed = 1) {
    Pcg32 rng(seed);
    std::vector<Camera> cameras;
    std::vector<PoseMetric> metrics;
    std::vector<PoseVector> x(views.size());
    for (size_t v = 0; v < views.size(); ++v) {
        cameras.push_back(views[v].camera);
        metrics.emplace_back(cameras[v], places, 1);
        for (double& value : x[v]) value = rng.normal();
        const double size = px / metrics[v].shift_px(metrics[v].to_step(x[v]));
        for (double& value : x[v]) value *= size;
    }
    Gauge(cameras, metrics).remove(x);
    for (size_t v = 0; v < views.size(); ++v)
        views[v].camera = moved_camera(cameras[v], metrics[v].to_step(x[v]));
}

}  // namespace darb::test
