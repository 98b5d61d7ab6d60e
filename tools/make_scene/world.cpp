#include "tools/make_scene/world.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace darb::make_scene {

namespace {

using glm::dvec3;

constexpr double kFar = 1e9;
constexpr double kSkin = 1e-5;  // world units; keeps a ray off the surface it leaves
const dvec3 kSun = glm::normalize(dvec3(0.55, -0.45, 0.9));
const dvec3 kSunColour = dvec3(1.0, 0.93, 0.82) * 1.9;
constexpr double kSunSpread = 0.07;      // softness of shadows
constexpr double kOcclusionReach = 0.9;  // world units
constexpr int kBounces = 3;

struct Hit {
    double t = kFar;
    dvec3 normal{0.0};
    const Object* object = nullptr;
    bool floor = false;
    bool any() const { return t < kFar; }
};

bool may_touch(const Object& object, const Ray& ray, double t_max) {
    const dvec3 to = object.position - ray.origin;
    const double along = glm::dot(to, ray.direction);
    const double radius = bounding_radius(object.shape, object.size);
    return along > -radius && along - radius < t_max &&
           glm::dot(to, to) - along * along <= radius * radius;
}

Hit nearest(const World& world, const Ray& ray, double t_max = kFar) {
    Hit hit;
    hit.t = t_max;
    for (const Object& object : world.objects) {
        if (!may_touch(object, ray, hit.t)) continue;
        const dvec3 origin = (ray.origin - object.position) * object.rotation;
        const Ray local{origin, ray.direction * object.rotation};
        if (const auto found = intersect(object.shape, object.size, local, kSkin, hit.t))
            hit = {found->t, object.rotation * found->normal, &object, false};
    }
    const double t = (world.floor_z - ray.origin.z) / ray.direction.z;
    if (t > kSkin && t < hit.t) hit = {t, dvec3(0, 0, 1), nullptr, true};
    if (hit.object == nullptr && !hit.floor) hit.t = kFar;
    return hit;
}

dvec3 sky(const World& world, const dvec3& direction) {
    const double up = std::clamp(direction.z, 0.0, 1.0);
    dvec3 blue = glm::mix(dvec3(0.80, 0.86, 0.92), dvec3(0.24, 0.44, 0.78), std::sqrt(up));
    if (world.clouds > 0) {  // low ones are seen from the side, and flat
        const double cloud = fbm(direction * dvec3(3, 3, 7), 5);
        blue = glm::mix(blue, dvec3(1.0, 0.98, 0.95),
                        world.clouds * glm::smoothstep(0.42, 0.62, cloud));
    }
    const double glow = std::max(0.0, glm::dot(direction, kSun));
    return blue + dvec3(1.0, 0.85, 0.6) * (0.35 * std::pow(glow, 12) + 6 * std::pow(glow, 900));
}

// A direction around the axis, spread 0 = the axis, 1 = cosine over the hemisphere.
dvec3 scatter(const dvec3& axis, double spread, Pcg32& rng) {
    const double angle = kTau * rng.uniform(), z = 2 * rng.uniform() - 1;
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    const dvec3 ball(r * std::cos(angle), r * std::sin(angle), z);
    return glm::normalize(axis + spread * 0.999 * ball);
}

dvec3 diffuse_light(const World& world, const dvec3& point, const dvec3& normal, Pcg32& rng) {
    const dvec3 to_sun = scatter(kSun, kSunSpread, rng);
    const double facing = glm::dot(normal, to_sun);
    const bool lit = facing > 0 && !nearest(world, {point, to_sun}).any();
    const dvec3 to_sky = scatter(normal, 1, rng);
    const Hit blocker = nearest(world, {point, to_sky}, kOcclusionReach);
    const double open = blocker.any() ? 0.25 + 0.5 * blocker.t / kOcclusionReach : 1.0;
    const dvec3 above(0.50, 0.60, 0.74), below(0.34, 0.29, 0.24);
    const dvec3 ambient = glm::mix(below, above, 0.5 + 0.5 * normal.z);
    return 0.62 * open * ambient + (lit ? facing : 0.0) * kSunColour;
}

dvec3 shade(const World& world, const Ray& ray, int bounces, Pcg32& rng) {
    const Hit hit = nearest(world, ray);
    if (!hit.any()) return sky(world, ray.direction);
    const dvec3 point = ray.at(hit.t) + kSkin * hit.normal;
    const Material& m = hit.floor ? world.floor : hit.object->material;
    dvec3 local = point, local_normal = hit.normal;
    if (!hit.floor) {
        local = (point - hit.object->position) * hit.object->rotation;
        local_normal = hit.normal * hit.object->rotation;
    }
    const dvec3 base = albedo(m.texture, local, local_normal, m.a, m.b, m.period);
    const double cosine = std::clamp(-glm::dot(ray.direction, hit.normal), 0.0, 1.0);
    const double fresnel =
        m.gloss > 0 ? m.gloss + (1 - m.gloss) * 0.7 * std::pow(1 - cosine, 5) : 0.0;
    dvec3 colour(0.0);
    if (!m.metal) colour = (1 - fresnel) * base * diffuse_light(world, point, hit.normal, rng);
    if (fresnel > 0.01 && bounces > 0) {
        const dvec3 mirrored = glm::reflect(ray.direction, hit.normal);
        const Ray next{point, scatter(mirrored, m.blur, rng)};
        colour += fresnel * (m.metal ? base : dvec3(1)) * shade(world, next, bounces - 1, rng);
    }
    if (!hit.floor) return colour;
    const double away =
        glm::smoothstep(world.fades_from, world.fades_to, glm::length(glm::dvec2(point)));
    return glm::mix(colour, sky(world, dvec3(ray.direction.x, ray.direction.y, 0)) * 0.92, away);
}

dvec3 rgb(double r, double g, double b) {  // sRGB bytes to linear, by a plain power of 2.2
    return glm::pow(dvec3(r, g, b) / 255.0, dvec3(2.2));
}

glm::dmat3 turned(double about_z, double tilt = 0) {  // degrees
    const double c = std::cos(glm::radians(about_z)), s = std::sin(glm::radians(about_z));
    const double u = std::cos(glm::radians(tilt)), v = std::sin(glm::radians(tilt));
    return glm::dmat3(c, s, 0, -s, c, 0, 0, 0, 1) * glm::dmat3(1, 0, 0, 0, u, v, 0, -v, u);
}

}  // namespace

World still_life() {
    const Material wood{Texture::wood, rgb(214, 164, 104), rgb(126, 76, 38), 0.11, 0.04, 0.12};
    const Material pale{Texture::wood, rgb(232, 200, 150), rgb(182, 134, 84), 0.06, 0.03, 0.2};
    const Material checker{
        Texture::checker, rgb(196, 40, 36), rgb(240, 232, 210), 0.13, 0.04, 0.05};
    const Material marble{Texture::marble, rgb(226, 234, 226), rgb(48, 96, 78), 0.34, 0.05, 0.03};
    const Material enamel{Texture::plain, rgb(18, 66, 140), rgb(0, 0, 0), 1, 0.16, 0.01};
    const Material gold{Texture::plain, rgb(236, 188, 92), rgb(0, 0, 0), 1, 0.9, 0.03, true};
    const Material ring{
        Texture::stripes, rgb(24, 138, 140), rgb(238, 236, 224), 1.0 / 9, 0.05, 0.03};
    const Material ball{Texture::beach_ball, rgb(200, 36, 44), rgb(34, 92, 176), 1, 0.04, 0.08};
    const Material dotted{Texture::dots, rgb(238, 186, 40), rgb(92, 44, 120), 0.08, 0.04, 0.06};
    const Material cone{Texture::stripes, rgb(60, 132, 52), rgb(60, 132, 52), 1, 0.06, 0.05};
    const Material floor{Texture::tiles, rgb(202, 190, 172), rgb(146, 138, 132), 0.5, 0.0, 0.0};
    World world;
    world.objects = {
        {Shape::cylinder, {1.25, 0, 0.05}, {0, 0, -0.05}, turned(0), wood},
        {Shape::sphere, {0.36, 0, 0}, {-0.42, 0.45, 0.36}, turned(0), enamel},
        {Shape::box, {0.26, 0.26, 0.26}, {0.52, 0.45, 0.26}, turned(27), checker},
        {Shape::cylinder, {0.19, 0, 0.38}, {0, -0.02, 0.38}, turned(0), marble},
        {Shape::sphere, {0.16, 0, 0}, {0, -0.02, 0.92}, turned(0), gold},
        {Shape::torus, {0.25, 0.095, 0}, {-0.64, -0.38, 0.095}, turned(10), ring},
        {Shape::sphere, {0.23, 0, 0}, {0.62, -0.36, 0.23}, turned(35, 50), ball},
        {Shape::box, {0.30, 0.11, 0.08}, {-0.02, -0.80, 0.08}, turned(-14), pale},
        {Shape::box, {0.12, 0.12, 0.12}, {-0.06, -0.79, 0.28}, turned(22), dotted},
        {Shape::cone, {0.17, 0.02, 0.26}, {0.02, 0.88, 0.26}, turned(0), cone},
    };
    world.floor = floor;
    world.floor_z = -0.10;
    return world;
}

double depth_along(const World& world, const Ray& ray) {
    const Hit hit = nearest(world, ray);
    return hit.any() ? hit.t : -1;
}

dvec3 radiance(const World& world, const Ray& ray, Pcg32& rng) {
    return shade(world, ray, kBounces, rng);
}

}  // namespace darb::make_scene
