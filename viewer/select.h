// Which splats a rectangle, a lasso, a brush, a box, a sphere or a range of values has. Pure
// mathematics; pixels are those of the camera, splats count by their centre, also those that
// others hide.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// [N] 1: has it, 0: has not.
using SplatMask = std::vector<std::uint8_t>;

/// A box along the world's axes, or a sphere.
struct Region {
    enum class Shape { box, sphere };
    Shape shape = Shape::box;
    glm::dvec3 centre{0.0};     // world
    glm::dvec3 half_size{1.0};  // world; of a sphere x is the radius
    bool contains(const glm::dvec3& p) const;
};

/// Opposite corners, px.
SplatMask in_rectangle(const SplatModel& model, const Camera& camera, glm::dvec2 a, glm::dvec2 b);
/// px; its ends are joined, even-odd.
SplatMask in_lasso(const SplatModel& model, const Camera& camera,
                   const std::vector<glm::dvec2>& lasso);
/// Within the radius of the line through the points, px.
SplatMask under_brush(const SplatModel& model, const Camera& camera,
                      const std::vector<glm::dvec2>& stroke, double radius);
SplatMask in_region(const SplatModel& model, const Region& region);
/// Opacity, 0 to 1.
SplatMask by_opacity(const SplatModel& model, double low, double high);
/// Largest standard deviation, world units.
SplatMask by_scale(const SplatModel& model, double low, double high);
/// Colours without harmonics above degree 0, all channels within the tolerance, sRGB 0 to 1.
SplatMask by_colour(const SplatModel& model, const glm::dvec3& colour, double tolerance);
/// The base colour, sRGB, not clamped.
glm::dvec3 base_colour(const SplatModel& model, std::size_t splat);
/// And all splats nearer than `distance` (world units, above 0) to one of the mask.
SplatMask grown(const SplatModel& model, const SplatMask& mask, double distance);

}  // namespace darb
