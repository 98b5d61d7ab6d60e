// SPDX-License-Identifier: MIT
#include "engine/reference/reference_stereo.h"

#include <cmath>
#include <optional>
#include <vector>

#include "shaders/shared/stereo_args.h"

namespace darb::reference {

namespace {

glm::dvec3 ray(const Camera& camera, double x, double y) {
    const glm::dvec3 inside((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1);
    return glm::transpose(camera.rotation) * inside;
}

// Interpolates between the centres of four pixels, all of which must be part of the photo.
std::optional<double> grey_between(const StereoView& view, const glm::dvec3& point) {
    const Camera& c = view.camera;
    const glm::dvec3 p = c.rotation * point + c.translation;
    if (!(p.z > 0)) return std::nullopt;
    const double x = c.fx * p.x / p.z + c.cx - 0.5, y = c.fy * p.y / p.z + c.cy - 0.5;
    if (!(x >= 0 && y >= 0 && x < view.grey.width - 1 && y < view.grey.height - 1))
        return std::nullopt;
    double sum = 0;
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
            const int column = static_cast<int>(x) + i, row = static_cast<int>(y) + j;
            const double grey = view.grey.at(column, row, 0);
            if (grey < 0) return std::nullopt;
            sum += grey * (1 - std::abs(x - column)) * (1 - std::abs(y - row));
        }
    return sum;
}

struct Pair {
    double weight, own, other;
};

double weighted_variance(const std::vector<Pair>& pairs, double total, double Pair::*a,
                         double Pair::*b) {
    double mean_a = 0, mean_b = 0, sum = 0;
    for (const Pair& p : pairs) {
        mean_a += p.weight * p.*a / total;
        mean_b += p.weight * p.*b / total;
    }
    for (const Pair& p : pairs) sum += p.weight * (p.*a - mean_a) * (p.*b - mean_b) / total;
    return sum;
}

}  // namespace

double stereo_cost(const StereoView& from, const StereoView& to, int x, int y, double v,
                   double slope_x, double slope_y) {
    const Camera& c = from.camera;
    const auto on_plane = [&](double i, double j) {
        return c.centre() + ray(c, x + 0.5 + i, y + 0.5 + j) / (v + slope_x * i + slope_y * j);
    };
    // Three points near the pixel, whatever the slope, give the plane.
    constexpr double kNear = 1e-3;
    const glm::dvec3 middle = on_plane(0, 0);
    const glm::dvec3 normal = glm::cross(on_plane(kNear, 0) - middle, on_plane(0, kNear) - middle);
    std::vector<Pair> pairs;
    double total = 0, seen = 0;
    for (int j = -STEREO_RADIUS; j <= STEREO_RADIUS; ++j)
        for (int i = -STEREO_RADIUS; i <= STEREO_RADIUS; ++i) {
            const bool inside =
                x + i >= 0 && y + j >= 0 && x + i < from.grey.width && y + j < from.grey.height;
            if (((i + j) & 1) != 0 || !inside || from.grey.at(x + i, y + j, 0) < 0) continue;
            const double own = from.grey.at(x + i, y + j, 0);
            const double apart = (own - from.grey.at(x, y, 0)) / STEREO_GREY_SPREAD;
            const double away = std::hypot(i, j) / STEREO_PLACE_SPREAD;
            const double weight = std::exp(-0.5 * (apart * apart + away * away));
            total += weight;
            const glm::dvec3 along = ray(c, x + 0.5 + i, y + 0.5 + j);
            const double depth = glm::dot(normal, middle - c.centre()) / glm::dot(normal, along);
            const auto other = grey_between(to, c.centre() + depth * along);
            if (!other) continue;
            seen += weight;
            pairs.push_back({weight, own, *other});
        }
    if (!(seen > 0.5 * total)) return STEREO_NO_COST;
    const double own = weighted_variance(pairs, seen, &Pair::own, &Pair::own),
                 other = weighted_variance(pairs, seen, &Pair::other, &Pair::other);
    if (own < STEREO_LEAST_VARIANCE || other < STEREO_LEAST_VARIANCE) return STEREO_NO_COST;
    return 1 - weighted_variance(pairs, seen, &Pair::own, &Pair::other) / std::sqrt(own * other);
}

}  // namespace darb::reference
