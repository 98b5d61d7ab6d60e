// SPDX-License-Identifier: MIT
// Where a scene lies on earth, and which way north is.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace darb {

/// A world position p is at rotation * p * (metres per unit) + offset, in metres east, north and up
/// of the anchor.
struct EarthPlace {
    double latitude = 0, longitude = 0, altitude = 0;  // of the anchor: degrees (WGS 84), metres
    glm::dmat3 rotation{0.0};  // of the world's axes to east, north and up; 0: not known
    glm::dvec3 offset{0.0};    // metres
    bool known() const { return rotation != glm::dmat3(0.0); }
    bool operator==(const EarthPlace&) const = default;
};

/// The place after the world was changed to scale * turn * p + move. metres_per_unit: after the
/// change.
EarthPlace moved_place(const EarthPlace& place, const glm::dmat3& turn, const glm::dvec3& move,
                       double metres_per_unit);

/// Ten numbers: latitude, longitude, altitude, the rotation as a quaternion w x y z, the offset.
std::string place_text(const EarthPlace& place);
/// Reads it back; nothing where it is something else.
std::optional<EarthPlace> place_from_text(std::string_view text);

/// For people: "47.12340 N, 8.54320 E, 412 m; north is 0.985 -0.174 0.000, up 0.000 0.000 1.000".
std::string place_summary(const EarthPlace& place);

}  // namespace darb
