// Procedural albedo, linear RGB in [0, 1], from a point in the object's own frame.
#pragma once

#include <glm/glm.hpp>
#include <numbers>

namespace darb::make_scene {

constexpr double kTau = 2 * std::numbers::pi;

enum class Texture { plain, checker, wood, marble, stripes, beach_ball, dots, tiles };

/// p: point on the surface, n: normal there, colours a and b, period: world units.
glm::dvec3 albedo(Texture texture, const glm::dvec3& p, const glm::dvec3& n, const glm::dvec3& a,
                  const glm::dvec3& b, double period);

/// Smooth value noise in [0, 1], one bump per unit; sums of it over `octaves` for fbm.
double noise(const glm::dvec3& p);
double fbm(glm::dvec3 p, int octaves);

}  // namespace darb::make_scene
