// SPDX-License-Identifier: MIT
#include "engine/scene/orbit_cameras.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/core/error.h"
#include "engine/scene/subject.h"

namespace darb {

namespace {

constexpr double kFieldOfView = 50 * std::numbers::pi / 180;  // horizontal
constexpr double kElevation = 20 * std::numbers::pi / 180;

struct Weighted {
    double value, weight;
};

/// The value below which a share of the weight lies.
double weighted_quantile(std::vector<Weighted> values, double share) {
    std::sort(values.begin(), values.end(),
              [](const Weighted& a, const Weighted& b) { return a.value < b.value; });
    double total = 0, sum = 0;
    for (const Weighted& v : values) total += v.weight;
    for (const Weighted& v : values) {
        sum += v.weight;
        if (sum >= share * total) return v.value;
    }
    return values.back().value;
}

/// Rows: right, down, forward.
glm::dmat3 look_at(const glm::dvec3& from, const glm::dvec3& to, const glm::dvec3& up) {
    const glm::dvec3 forward = glm::normalize(to - from);
    const glm::dvec3 right = glm::normalize(glm::cross(-up, forward));
    return glm::transpose(glm::dmat3(right, glm::cross(forward, right), forward));
}

}  // namespace

SceneBall opaque_ball(const SplatModel& model) {
    DARB_CHECK(model.size() > 0, "no splats");
    std::vector<double> opacity;
    for (const float logit : model.opacity_logit) opacity.push_back(sigmoid(logit));
    SceneBall ball;
    for (int c = 0; c < 3; ++c) {
        std::vector<Weighted> values;
        for (size_t i = 0; i < model.size(); ++i)
            values.push_back({model.position[i * 3 + c], opacity[i]});
        ball.centre[c] = weighted_quantile(std::move(values), 0.5);
    }
    std::vector<Weighted> distances;
    for (size_t i = 0; i < model.size(); ++i) {
        const float* p = &model.position[i * 3];
        distances.push_back({glm::length(glm::dvec3(p[0], p[1], p[2]) - ball.centre), opacity[i]});
    }
    ball.radius = std::max(weighted_quantile(std::move(distances), 0.9), 1e-6);
    return ball;
}

std::vector<Camera> orbit_cameras(const SplatModel& model, int count, int width, int height) {
    const SceneBall ball = opaque_ball(model);
    return orbit_cameras(Bounds{ball.centre + model.origin, ball.radius}, count, width, height,
                         {0, -1, 0});
}

std::vector<Camera> orbit_cameras(const Bounds& ball, int count, int width, int height,
                                  const glm::dvec3& up) {
    const double distance = ball.radius / std::sin(kFieldOfView * 0.5 * height / width);
    const glm::dvec3 front = usual_front(up), across = glm::cross(up, front);
    std::vector<Camera> cameras;
    for (int v = 0; v < count; ++v) {
        const double turn = 2 * std::numbers::pi * v / count;
        const glm::dvec3 side = std::sin(turn) * across + std::cos(turn) * front;
        const glm::dvec3 eye =
            ball.centre + distance * (std::cos(kElevation) * side + std::sin(kElevation) * up);
        Camera camera;
        camera.width = width;
        camera.height = height;
        camera.fx = camera.fy = 0.5 * width / std::tan(0.5 * kFieldOfView);
        camera.cx = 0.5 * width;
        camera.cy = 0.5 * height;
        camera.rotation = look_at(eye, ball.centre, up);
        camera.translation = -(camera.rotation * eye);
        cameras.push_back(camera);
    }
    return cameras;
}

}  // namespace darb
