// The still life that the project ships: objects, light, and the colour seen along a ray.
#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "engine/core/rng.h"
#include "tools/make_scene/shapes.h"
#include "tools/make_scene/textures.h"

namespace darb::make_scene {

struct Material {
    Texture texture = Texture::plain;
    glm::dvec3 a{0.5}, b{0.5};  // linear RGB
    double period = 0.1;        // world units (stripes: share of a turn)
    double gloss = 0.04;        // reflectance seen head-on; 0 = none
    double blur = 0.02;         // of the reflection, as the spread of its direction
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
    double fades_from = 2.6, fades_to = 7.5;  // the floor into the sky, by the distance from 0
    double clouds = 0;                        // how white they are, 0 to 1
};

World still_life();

/// Distance to the nearest surface along the ray; negative: the sky.
double depth_along(const World& world, const Ray& ray);

/// Linear RGB along the ray, one random sample of soft shadow, occlusion and blurred reflection.
glm::dvec3 radiance(const World& world, const Ray& ray, Pcg32& rng);

}  // namespace darb::make_scene
