// Shapes of the generated scene, each in its own frame: centre at 0, axis along z.
#pragma once

#include <glm/glm.hpp>
#include <optional>

namespace darb::make_scene {

struct Ray {
    glm::dvec3 origin;
    glm::dvec3 direction;  // unit length
    glm::dvec3 at(double t) const { return origin + t * direction; }
};

enum class Shape { sphere, box, cylinder, cone, torus };

/// size: sphere (radius, -, -); box half extents; cylinder (radius, -, half height); cone (base
/// radius, top radius, half height); torus (ring radius, tube radius, -). World units.
struct ShapeHit {
    double t;
    glm::dvec3 normal;  // outward, unit length
};

/// The nearest hit with t in (t_min, t_max), ray and result in the shape's frame.
std::optional<ShapeHit> intersect(Shape shape, const glm::dvec3& size, const Ray& ray, double t_min,
                                  double t_max);

/// Radius of a sphere around 0 that holds the shape.
double bounding_radius(Shape shape, const glm::dvec3& size);

}  // namespace darb::make_scene
