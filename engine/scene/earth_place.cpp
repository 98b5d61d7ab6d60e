// SPDX-License-Identifier: MIT
#include "engine/scene/earth_place.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <system_error>

#include "engine/core/parse_number.h"

namespace darb {

EarthPlace moved_place(const EarthPlace& place, const glm::dmat3& turn, const glm::dvec3& move,
                       double metres_per_unit) {
    EarthPlace moved = place;
    moved.rotation = place.rotation * glm::transpose(turn);
    moved.offset = place.offset - metres_per_unit * (moved.rotation * move);
    return moved;
}

std::string place_text(const EarthPlace& place) {
    const glm::dquat q = glm::quat_cast(place.rotation);
    return fmt::format(
        "{:.10g} {:.10g} {:.10g} {:.10g} {:.10g} {:.10g} {:.10g} {:.10g} {:.10g} "
        "{:.10g}",
        place.latitude, place.longitude, place.altitude, q.w, q.x, q.y, q.z, place.offset.x,
        place.offset.y, place.offset.z);
}

std::optional<EarthPlace> place_from_text(std::string_view text) {
    std::array<double, 10> values{};
    const char *at = text.data(), *const end = at + text.size();
    for (double& value : values) {
        while (at != end && *at == ' ') ++at;
        const auto [behind, error] = parse_number(at, end, value);
        if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
        at = behind;
    }
    const glm::dquat q(values[3], values[4], values[5], values[6]);
    if (at != end || std::abs(values[0]) > 90 || std::abs(values[1]) > 360 ||
        std::abs(glm::length(q) - 1) > 1e-3)
        return std::nullopt;
    return EarthPlace{values[0],
                      values[1],
                      values[2],
                      glm::mat3_cast(glm::normalize(q)),
                      {values[7], values[8], values[9]}};
}

std::string place_summary(const EarthPlace& place) {
    const glm::dvec3 north = glm::transpose(place.rotation) * glm::dvec3(0, 1, 0);
    const glm::dvec3 up = glm::transpose(place.rotation) * glm::dvec3(0, 0, 1);
    return fmt::format(
        "{:.5f} {}, {:.5f} {}, {:.0f} m; north is {:.3f} {:.3f} {:.3f}, up {:.3f} {:.3f} {:.3f}",
        std::abs(place.latitude), place.latitude < 0 ? "S" : "N", std::abs(place.longitude),
        place.longitude < 0 ? "W" : "E", place.altitude, north.x, north.y, north.z, up.x, up.y,
        up.z);
}

}  // namespace darb
