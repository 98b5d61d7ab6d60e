#include "viewer/gizmo.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr double kHandle = 0.11;  // of its size: so near a pointer takes it
constexpr int kRingSteps = 64;
constexpr double kEdgeOn = 0.05;  // cosine between a view ray and a ring's plane
constexpr double kLeastFactor = 0.01, kMostFactor = 100;

glm::dvec3 axis_of(int axis) {
    glm::dvec3 v(0.0);
    v[axis] = 1;
    return v;
}

// World units of the gizmo's size.
double size_of(const Gizmo& g, const Camera& c) {
    const double depth = (c.rotation * g.centre + c.translation).z;
    return std::max(depth, 1e-6) * g.size_px / c.fx;
}

glm::dvec3 ray_of(const Camera& c, const glm::dvec2& px) {
    const glm::dvec3 d((px.x - c.cx) / c.fx, (px.y - c.cy) / c.fy, 1);
    return glm::normalize(glm::transpose(c.rotation) * d);
}

// Along an axis from the centre, to what is nearest to the ray.
std::optional<double> along_axis(const Gizmo& g, const Camera& c, int axis, const glm::dvec2& px) {
    const glm::dvec3 a = axis_of(axis), r = ray_of(c, px), w = g.centre - c.centre();
    const double ar = glm::dot(a, r), square = 1 - ar * ar;
    if (square < kEdgeOn * kEdgeOn) return {};
    return (ar * glm::dot(r, w) - glm::dot(a, w)) / square;
}

// On the ring's plane where the ray meets it, else on the screen.
std::optional<double> angle_on_ring(const Gizmo& g, const Camera& c, int axis,
                                    const glm::dvec2& px) {
    const glm::dvec3 n = axis_of(axis), r = ray_of(c, px);
    const double slope = glm::dot(r, n);
    if (std::abs(slope) < kEdgeOn) return {};
    const glm::dvec3 hit = c.centre() + r * (glm::dot(g.centre - c.centre(), n) / slope) - g.centre;
    return std::atan2(hit[(axis + 2) % 3], hit[(axis + 1) % 3]);
}

}  // namespace

std::vector<glm::dvec3> handle_lines(const Gizmo& g, const Camera& c, int axis) {
    const double size = size_of(g, c);
    if (g.mode == GizmoMode::move) return {g.centre, g.centre + size * axis_of(axis)};
    const bool turns = g.mode == GizmoMode::turn;
    if (!turns && axis != 0) return {};
    const glm::dmat3 from_camera = glm::transpose(c.rotation);
    const glm::dvec3 u = turns ? axis_of((axis + 1) % 3) : from_camera[0];
    const glm::dvec3 v = turns ? axis_of((axis + 2) % 3) : from_camera[1];
    std::vector<glm::dvec3> ring;
    for (int i = 0; i <= kRingSteps; ++i) {
        const double angle = 2 * glm::pi<double>() * i / kRingSteps;
        ring.push_back(g.centre + size * (std::cos(angle) * u + std::sin(angle) * v));
    }
    return ring;
}

std::optional<int> handle_at(const Gizmo& g, const Camera& c, const glm::dvec2& px) {
    std::optional<int> best;
    double nearest = kHandle * g.size_px;
    for (int axis = 0; axis < 3; ++axis) {
        const std::vector<glm::dvec3> lines = handle_lines(g, c, axis);
        for (std::size_t i = 1; i < lines.size(); ++i) {
            const auto a = pixel_of(c, lines[i - 1]), b = pixel_of(c, lines[i]);
            if (!a || !b) continue;
            const double distance = distance_to_segment(px, *a, *b);
            if (distance >= nearest) continue;
            nearest = distance;
            best = axis;
        }
    }
    return best;
}

Similarity about(const glm::dvec3& centre, double scale, const glm::dmat3& turn,
                 const glm::dvec3& shift) {
    return {scale, turn, centre + shift - scale * (turn * centre)};
}

Similarity dragged(const Gizmo& g, const Camera& c, int handle, const glm::dvec2& from,
                   const glm::dvec2& to) {
    if (g.mode == GizmoMode::move) {
        const auto a = along_axis(g, c, handle, from), b = along_axis(g, c, handle, to);
        return about(g.centre, 1, glm::dmat3(1.0),
                     a && b ? (*b - *a) * axis_of(handle) : glm::dvec3(0.0));
    }
    if (g.mode == GizmoMode::turn) {
        const auto a = angle_on_ring(g, c, handle, from), b = angle_on_ring(g, c, handle, to);
        if (!a || !b) return {};
        return about(g.centre, 1,
                     glm::dmat3(glm::rotate(glm::dmat4(1.0), *b - *a, axis_of(handle))));
    }
    const auto centre = pixel_of(c, g.centre);
    const double before = centre ? glm::distance(from, *centre) : 0;
    if (!(before > 0)) return {};
    const double factor = glm::distance(to, *centre) / before;
    return about(g.centre, std::clamp(factor, kLeastFactor, kMostFactor), glm::dmat3(1.0));
}

}  // namespace darb
