// SPDX-License-Identifier: MIT
// Steps of a pose in pixels, and steps that move the scene as a whole.
#include "engine/scene/pose_metric.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/rng.h"

namespace darb::test {
namespace {

Camera camera_at(double angle) {
    Camera c;
    c.width = 200;
    c.height = 150;
    c.fx = 210;
    c.fy = 220;
    c.cx = 95;
    c.cy = 80;
    c.rotation = exp_rotation({0.2, angle, -0.1});
    c.translation = {0.1, -0.2, 4};
    return c;
}

std::vector<glm::dvec3> places() {
    Pcg32 rng(2);
    std::vector<glm::dvec3> all;
    for (int p = 0; p < 100; ++p)
        all.emplace_back(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
    return all;
}

glm::dvec2 pixel(const Camera& c, const glm::dvec3& x) {
    const glm::dvec3 p = c.rotation * x + c.translation;
    return {c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy};
}

TEST(PoseMetric, a_step_of_one_shifts_the_picture_by_a_pixel) {
    const Camera camera = camera_at(0.4);
    const auto all = places();
    const PoseMetric metric(camera, all, 1);
    for (size_t k = 0; k < 6; ++k) {
        PoseVector x{};
        x[k] = 0.01;
        const PoseVector step = metric.to_step(x);
        EXPECT_NEAR(metric.from_step(step)[k], 0.01, 1e-12);
        double sum = 0, count = 0;
        for (const glm::dvec3& at : all) {
            const glm::dvec2 p = pixel(camera, at);
            if (p.x < 0 || p.y < 0 || p.x >= 200 || p.y >= 150) continue;
            sum += std::pow(glm::distance(p, pixel(moved_camera(camera, step), at)), 2);
            ++count;
        }
        const double shift = std::sqrt(sum / count);
        EXPECT_NEAR(metric.shift_px(step), shift, 0.01 * shift);
        EXPECT_LE(shift, 0.0101);  // less where a direction is damped
        EXPECT_GE(shift, 0.003);
    }
}

TEST(PoseMetric, gradients_follow_its_coordinates) {
    const Camera camera = camera_at(0.4);
    const PoseMetric metric(camera, places(), 1);
    const PoseVector d_step{1, -2, 0.5, 3, -1, 2};
    const PoseVector d = metric.gradient(d_step);
    PoseVector x{0.1, -0.3, 0.2, 0.5, 0.4, -0.6};
    const PoseVector step = metric.to_step(x);
    double by_x = 0, by_step = 0;
    for (size_t i = 0; i < 6; ++i) by_x += d[i] * x[i], by_step += d_step[i] * step[i];
    EXPECT_NEAR(by_x, by_step, 1e-12);
}

TEST(PoseMetric, pixels_change_as_their_derivatives_say) {
    const Camera camera = camera_at(-0.3);
    const glm::dvec3 at(0.3, -0.2, 0.5);
    const auto d = pixel_by_pose(camera, camera.rotation * at + camera.translation);
    for (size_t k = 0; k < 6; ++k) {
        PoseVector step{};
        step[k] = 1e-6;
        const glm::dvec2 up = pixel(moved_camera(camera, step), at);
        step[k] = -1e-6;
        const glm::dvec2 change = (up - pixel(moved_camera(camera, step), at)) / 2e-6;
        EXPECT_NEAR(d[0][k], change.x, 1e-4);
        EXPECT_NEAR(d[1][k], change.y, 1e-4);
    }
}

TEST(PoseMetric, the_left_jacobian_is_the_derivative_of_the_turn) {
    for (const glm::dvec3 v : {glm::dvec3(0.3, -0.5, 0.2), glm::dvec3(1e-6, 2e-6, -1e-6)})
        for (int k = 0; k < 3; ++k) {
            glm::dvec3 step(0.0);
            step[k] = 1e-6;
            const glm::dmat3 change = (exp_rotation(v + step) - exp_rotation(v - step)) / 2e-6;
            const glm::dmat3 left = change * glm::transpose(exp_rotation(v));
            const glm::dvec3 axial(left[1][2], left[2][0], left[0][1]);
            EXPECT_LT(glm::distance(axial, left_jacobian(v)[k]), 1e-8);
        }
}

TEST(Gauge, takes_out_what_moves_the_world_and_leaves_the_rest) {
    std::vector<Camera> cameras;
    std::vector<PoseMetric> metrics;
    for (int c = 0; c < 5; ++c) {
        cameras.push_back(camera_at(0.5 * c));
        metrics.emplace_back(cameras.back(), places(), 1);
    }
    const Gauge gauge(cameras, metrics);
    // The world turned, moved and scaled a little: cameras that see the same.
    const glm::dmat3 turn = exp_rotation({1e-5, -2e-5, 1.5e-5});
    const glm::dvec3 move(2e-5, 1e-5, -1e-5);
    const double scale = 1 + 1e-5;
    std::vector<PoseVector> x;
    for (size_t c = 0; c < cameras.size(); ++c) {
        const glm::dmat3 rotation = cameras[c].rotation * glm::transpose(turn);
        const glm::dvec3 translation = scale * cameras[c].translation - rotation * move;
        const glm::dmat3 left = rotation * glm::transpose(cameras[c].rotation);
        const glm::dvec3 w(left[1][2], left[2][0], left[0][1]);
        const glm::dvec3 v = translation - left * cameras[c].translation;
        x.push_back(metrics[c].from_step({w.x, w.y, w.z, v.x, v.y, v.z}));
    }
    double before = 0, after = 0;
    for (const PoseVector& one : x)
        for (const double value : one) before += value * value;
    gauge.remove(x);
    for (const PoseVector& one : x)
        for (const double value : one) after += value * value;
    EXPECT_GT(before, 1e-8);
    EXPECT_LT(std::sqrt(after), 1e-3 * std::sqrt(before));
    std::vector<PoseVector> one(5);
    one[2][1] = 1;
    gauge.remove(one);
    EXPECT_GT(one[2][1], 0.5) << "a camera of its own stays";
    std::vector<PoseVector> again = one;
    gauge.remove(again);
    for (size_t c = 0; c < 5; ++c)
        for (size_t i = 0; i < 6; ++i) EXPECT_NEAR(again[c][i], one[c][i], 1e-12);
}

}  // namespace
}  // namespace darb::test
