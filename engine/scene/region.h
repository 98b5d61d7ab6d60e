// SPDX-License-Identifier: MIT
// Region: a part of space that is kept by cleaning or grows in training, and how it is written on
// a command line.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// What stands on a polygon on the ground, between two heights.
struct Prism {
    glm::dvec3 at{0.0};                               // world, a point of the ground
    glm::dvec3 u{1, 0, 0}, v{0, 0, 1}, up{0, -1, 0};  // of length 1, at right angles
    std::vector<glm::dvec2> corners = {};             // along u and v from `at`, world units
    double low = 0, high = 0;                         // along `up` from `at`, world units
    /// By the even-odd rule, so that a polygon that crosses itself has holes.
    bool contains(const glm::dvec3& p) const;
};

/// A box along the world's axes, a sphere or a prism.
struct Region {
    enum class Shape { box, sphere, prism };
    Shape shape = Shape::box;
    glm::dvec3 centre{0.0};     // world
    glm::dvec3 half_size{1.0};  // world; for a sphere x is the radius
    Prism prism = {};           // for a prism, which has no centre and no size
    bool contains(const glm::dvec3& p) const;
};

/// [N], 1 for splats whose centres lie outside.
std::vector<std::uint8_t> splats_outside(const Region& region, const SplatModel& model);

/// How the help of an option describes the regions that it takes.
inline constexpr const char* kRegionHelp =
    "subject, which is what the cameras look at, with 1.25 times its radius; subject:F, with F "
    "times its radius; sphere:X,Y,Z,RADIUS; box:MINX,MINY,MINZ,MAXX,MAXY,MAXZ; or "
    "polygon:LOW,HIGH,X,Y,Z,X,Y,Z,X,Y,Z,..., what stands on these corners from LOW to HIGH above "
    "their plane";

/// Throws Error, naming the option, where the text cannot be a region of any scene.
void check_region(const std::string& option, const std::string& text);

/// The region that the text means in this scene. Cameras tell what `subject` is and which side of a
/// polygon is up; without cameras, the splats do. Throws Error as check_region() does, and also
/// where the cameras look at no subject, or a polygon's corners lie on a line or its plane is
/// upright.
Region region_from(const std::string& option, const std::string& text, const SplatModel& model,
                   std::span<const Camera> cameras);

/// The region's numbers as text, with every digit that counts: equal regions have equal texts.
std::string region_text(const Region& region);

}  // namespace darb
