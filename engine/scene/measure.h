// SPDX-License-Identifier: MIT
// Measuring in a scene: points on its surface, what lies between them, and what they say about the
// scene: how long a unit is, and which way is up. Pure mathematics, without a device.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <optional>
#include <string>
#include <vector>

namespace darb {

/// Points that were picked, in order; closed: the last is joined to the first.
struct Measurement {
    std::vector<glm::dvec3> points;  // world
    bool closed = false;             // only with three points or more
    bool operator==(const Measurement&) const = default;
};

/// A view of a scene: where its eye is, how it is turned and how wide it sees.
struct NoteCamera {
    glm::dvec3 eye{0.0};                 // world
    glm::dquat orientation{1, 0, 0, 0};  // camera to world
    double fov_y = 0;                    // rad
    bool operator==(const NoteCamera&) const = default;
};

/// A remark at a place of the scene, shown as a label.
struct SceneNote {
    glm::dvec3 at{0.0};  // world
    std::string title, text;
    std::optional<NoteCamera> camera;  // from where it is meant to be looked at
    bool operator==(const SceneNote&) const = default;
};

/// What is known of a scene besides its splats.
struct SceneFacts {
    double metres_per_unit = 0;    // 0: not known
    std::optional<glm::dvec3> up;  // unit vector; nothing: as the scene was opened
    bool ground = false;           // `up` is that of a ground that was picked
    Measurement measured;
    std::vector<SceneNote> notes;
    bool operator==(const SceneFacts&) const = default;
};

/// World units.
struct MeasuredLengths {
    std::vector<double> sides;        // between neighbours; the last closes the polygon
    double total = 0;                 // of all sides
    double height = 0;                // of the last point above the first, along `up`
    double across = 0;                // between the two, at right angles to `up`
    std::optional<double> area;       // of a closed polygon
    std::optional<double> off_plane;  // the largest distance of its corners from its plane
};
/// up: a unit vector. The area is that of the polygon, projected onto the plane that fits it best.
MeasuredLengths measured_lengths(const Measurement& measurement, const glm::dvec3& up);

/// The unit vector at right angles to the polygon of the points, on the side of `up`; nothing where
/// there are fewer than three points, or all lie on a line.
std::optional<glm::dvec3> up_of_ground(const Measurement& measurement, const glm::dvec3& up);

/// "1.234 m" where a unit's length is known, else "1.234 units"; with power 2 "m²" and "units²".
std::string length_text(double units, double metres_per_unit, int power = 1);

}  // namespace darb
