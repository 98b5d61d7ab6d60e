// SPDX-License-Identifier: MIT
// Shapes of the generated scene, each in its own frame: centred on 0, with its axis along z.
#pragma once

#include <glm/glm.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/rng.h"

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

/// The nearest hit with t in (t_min, t_max); ray and result are in the shape's frame.
std::optional<ShapeHit> intersect(Shape shape, const glm::dvec3& size, const Ray& ray, double t_min,
                                  double t_max);

/// Radius of a sphere around 0 that contains the shape.
double bounding_radius(Shape shape, const glm::dvec3& size);

// Procedural albedo, linear RGB in [0, 1], from a point in the object's own frame.

constexpr double kTau = 2 * std::numbers::pi;

enum class Texture { plain, checker, wood, marble, stripes, beach_ball, dots, tiles };

/// p: point on the surface; n: its normal; a and b: colours; period: world units.
glm::dvec3 albedo(Texture texture, const glm::dvec3& p, const glm::dvec3& n, const glm::dvec3& a,
                  const glm::dvec3& b, double period);

/// Smooth value noise in [0, 1], with one bump per unit; summed over `octaves` for fbm.
double noise(const glm::dvec3& p);
double fbm(glm::dvec3 p, int octaves);

// The still life that the project ships: objects, light, and the colour seen along a ray.

struct Material {
    Texture texture = Texture::plain;
    glm::dvec3 a{0.5}, b{0.5};  // linear RGB
    double period = 0.1;        // world units (stripes: share of a turn)
    double gloss = 0.04;        // reflectance seen head-on; 0 = none
    double blur = 0.02;         // spread of the reflection's direction
    bool metal = false;         // tints the reflection with a, no diffuse part
};

struct Object {
    Shape shape = Shape::sphere;
    glm::dvec3 size{1.0};
    glm::dvec3 position{0.0};
    glm::dmat3 rotation{1.0};  // object to world
    Material material;
};

struct World {
    std::vector<Object> objects;
    Material floor;
    double floor_z = 0;
    double fades_from = 2.6, fades_to = 7.5;  // distances from 0 over which the floor fades into
                                              // the sky
    double clouds = 0;                        // how white they are, 0 to 1
};

World still_life();

/// Distance to the nearest surface along the ray; negative: the sky.
double depth_along(const World& world, const Ray& ray);

/// Linear RGB along the ray, with one random sample of soft shadow, occlusion and blurred
/// reflection.
glm::dvec3 radiance(const World& world, const Ray& ray, Pcg32& rng);

}  // namespace darb::make_scene
