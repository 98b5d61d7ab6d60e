// SPDX-License-Identifier: MIT
#include "engine/scene/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace darb {

namespace {

/// Twice the polygon's area, as a vector at right angles to it (Newell).
glm::dvec3 area_vector(const std::vector<glm::dvec3>& points) {
    glm::dvec3 sum(0.0);
    for (std::size_t i = 1; i + 1 < points.size(); ++i)
        sum += glm::cross(points[i] - points[0], points[i + 1] - points[0]);
    return sum;
}

double longest_side(const std::vector<double>& sides) {
    return sides.empty() ? 0 : *std::ranges::max_element(sides);
}

}  // namespace

MeasuredLengths measured_lengths(const Measurement& measurement, const glm::dvec3& up) {
    const std::vector<glm::dvec3>& points = measurement.points;
    MeasuredLengths lengths;
    const std::size_t count = points.size();
    for (std::size_t i = 0; i + 1 < count; ++i)
        lengths.sides.push_back(glm::distance(points[i], points[i + 1]));
    const bool closed = measurement.closed && count >= 3;
    if (closed) lengths.sides.push_back(glm::distance(points.back(), points.front()));
    for (const double side : lengths.sides) lengths.total += side;
    if (count < 2) return lengths;
    const glm::dvec3 along = points.back() - points.front();
    lengths.height = glm::dot(along, up);
    lengths.across = glm::length(along - lengths.height * up);
    if (!closed) return lengths;
    const glm::dvec3 area = area_vector(points);
    lengths.area = glm::length(area) / 2;
    glm::dvec3 middle(0.0);
    for (const glm::dvec3& p : points) middle += p / double(count);
    const glm::dvec3 normal = *lengths.area > 0 ? glm::normalize(area) : glm::dvec3(0.0);
    lengths.off_plane = 0;
    for (const glm::dvec3& p : points)
        lengths.off_plane = std::max(*lengths.off_plane, std::abs(glm::dot(p - middle, normal)));
    return lengths;
}

std::optional<glm::dvec3> up_of_ground(const Measurement& measurement, const glm::dvec3& up) {
    constexpr double kOnALine = 1e-6;  // of the square of the longest side
    if (measurement.points.size() < 3) return {};
    const double longest = longest_side(measured_lengths(measurement, up).sides);
    const glm::dvec3 area = area_vector(measurement.points);
    if (!(glm::length(area) > kOnALine * longest * longest)) return {};
    const glm::dvec3 normal = glm::normalize(area);
    return glm::dot(normal, up) < 0 ? -normal : normal;
}

std::string length_text(double units, double metres_per_unit, int power) {
    const bool known = metres_per_unit > 0;
    const double value = known ? units * std::pow(metres_per_unit, power) : units;
    return fmt::format("{:.4g} {}{}", value, known ? "m" : "units", power == 2 ? "²" : "");
}

}  // namespace darb
