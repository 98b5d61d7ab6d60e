// SPDX-License-Identifier: MIT
#include "viewer/navigation.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <string>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr double kPoleMargin = glm::radians(1.0);
constexpr double kMinDistance = 1e-4;

glm::dmat3 rotation_about(const glm::dvec3& axis, double angle) {
    return glm::dmat3(glm::rotate(glm::dmat4(1.0), angle, axis));
}

// Otherwise the rounding errors of many small turns would add up.
void orthonormalise(glm::dmat3& axes) {
    axes[2] = glm::normalize(axes[2]);
    axes[0] = glm::normalize(axes[0] - glm::dot(axes[0], axes[2]) * axes[2]);
    axes[1] = glm::cross(axes[2], axes[0]);
}

}  // namespace

// Turns around `up` by to_right and around right by to_down, which stops at the poles.
void Navigation::turn(double to_right, double to_down) {
    const double from_up = std::acos(std::clamp(glm::dot(forward(), up), -1.0, 1.0));
    const double wanted =
        std::clamp(from_up + to_down, kPoleMargin, glm::pi<double>() - kPoleMargin);
    const bool tilts = std::abs(wanted - from_up) > 0 && glm::length(glm::cross(forward(), up)) > 0;
    // Positive angles about right tilt towards up; about up they turn left.
    const double tilt = tilts ? wanted - from_up : 0.0;
    axes = rotation_about(up, -to_right) * rotation_about(right(), -tilt) * axes;
    orthonormalise(axes);
}

void Navigation::look(double to_right, double to_down) {
    turn(to_right, to_down);
}

void Navigation::orbit(double to_right, double to_down) {
    const glm::dvec3 centre = pivot();
    turn(to_right, to_down);
    eye = centre - distance * forward();
}

void Navigation::pan(double dx_px, double dy_px, int height_px) {
    const double per_px = 2 * distance * std::tan(fov_y / 2) / std::max(height_px, 1);
    eye -= per_px * (dx_px * right() + dy_px * down());
}

void Navigation::zoom(double factor) {
    const glm::dvec3 centre = pivot();
    distance = std::max(distance * factor, kMinDistance);
    eye = centre - distance * forward();
}

void Navigation::fly(const glm::dvec3& step) {
    eye += step.x * right() - step.y * down() + step.z * forward();
}

void Navigation::frame(const glm::dvec3& centre, double radius, double aspect) {
    const double fov_x = 2 * std::atan(std::tan(fov_y / 2) * aspect);
    look_from(centre, radius / std::sin(std::min(fov_x, fov_y) / 2));
}

void Navigation::look_from(const glm::dvec3& centre, double from) {
    distance = std::max(from, kMinDistance);
    eye = centre - distance * forward();
}

void Navigation::set_pivot_depth(const glm::dvec3& point) {
    distance = std::max(glm::dot(point - eye, forward()), kMinDistance);
}

void Navigation::set_up(const glm::dvec3& new_up) {
    const glm::dvec3 to = glm::normalize(new_up), centre = pivot();
    glm::dvec3 axis = glm::cross(up, to);
    const double angle = std::atan2(glm::length(axis), glm::dot(up, to));
    // up was turned over
    if (glm::length(axis) < 1e-9) axis = forward() - glm::dot(forward(), up) * up;
    if (glm::length(axis) < 1e-9) axis = right();
    axes = rotation_about(glm::normalize(axis), angle) * axes;
    up = to;
    level();
    eye = centre - distance * forward();
}

void Navigation::view_from(const glm::dvec3& direction) {
    constexpr double kOffPole = 1e-4;  // rad
    const glm::dvec3 centre = pivot();
    glm::dvec3 ahead = -glm::normalize(direction);
    if (glm::length(glm::cross(ahead, up)) < kOffPole) {
        glm::dvec3 side = right() - glm::dot(right(), up) * up;
        if (glm::length(side) < kOffPole) side = glm::cross(up, glm::dvec3(up.y, up.z, up.x));
        side = glm::normalize(side);
        // where the view comes from ahead of the eye, the picture's top stays the way ahead
        ahead = glm::normalize(ahead + kOffPole * glm::cross(up, side));
    }
    axes[2] = ahead;
    axes[0] = glm::normalize(glm::cross(ahead, up));
    orthonormalise(axes);
    eye = centre - distance * forward();
}

void Navigation::level() {
    glm::dvec3 side = glm::cross(forward(), up);
    if (glm::length(side) < 1e-6) {  // where the view is straight up or down, any right will do
        side = right() - glm::dot(right(), up) * up;
        if (glm::length(side) < 1e-6) return;
    }
    axes[0] = glm::normalize(side);
    axes[1] = glm::cross(axes[2], axes[0]);
    turn(0, 0);
}

void Navigation::take(const Camera& camera) {
    eye = camera.centre();
    axes = glm::transpose(camera.rotation);
    fov_y = 2 * std::atan(0.5 * camera.height / camera.fy);
}

Camera Navigation::camera(int width_px, int height_px) const {
    Camera c;
    c.width = width_px;
    c.height = height_px;
    c.fx = c.fy = 0.5 * height_px / std::tan(fov_y / 2);
    c.cx = centre_x * width_px;
    c.cy = centre_y * height_px;
    c.rotation = glm::transpose(axes);
    c.translation = -(c.rotation * eye);
    return c;
}

std::string up_name(const glm::dvec3& up) {
    int best = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(up[i]) > std::abs(up[best])) best = i;
    return std::string(up[best] < 0 ? "-" : "") + "xyz"[best];
}

}  // namespace darb
