// SPDX-License-Identifier: MIT
#include "tools/lab/make_scene/world.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace darb::make_scene {

namespace {

using glm::dvec2;
using glm::dvec3;

bool between(double t, double t_min, double t_max) {
    return t > t_min && t < t_max;
}

std::optional<ShapeHit> hit_sphere(double radius, const Ray& ray, double t_min, double t_max) {
    const double b = glm::dot(ray.origin, ray.direction);
    const double square = b * b - glm::dot(ray.origin, ray.origin) + radius * radius;
    if (square < 0) return std::nullopt;
    for (const double t : {-b - std::sqrt(square), -b + std::sqrt(square)})
        if (between(t, t_min, t_max)) return ShapeHit{t, ray.at(t) / radius};
    return std::nullopt;
}

std::optional<ShapeHit> hit_box(const dvec3& half, const Ray& ray, double t_min, double t_max) {
    double enter = -1e300, leave = 1e300;
    int axis = 0;
    for (int i = 0; i < 3; ++i) {
        const double inverse = 1 / ray.direction[i];
        const double a = (-half[i] - ray.origin[i]) * inverse;
        const double b = (half[i] - ray.origin[i]) * inverse;
        if (std::min(a, b) > enter) {
            enter = std::min(a, b);
            axis = i;
        }
        leave = std::min(leave, std::max(a, b));
    }
    if (enter > leave || !between(enter, t_min, t_max)) return std::nullopt;
    dvec3 normal(0.0);
    normal[axis] = ray.direction[axis] > 0 ? -1 : 1;
    return ShapeHit{enter, normal};
}

std::optional<ShapeHit> hit_cylinder(double radius, double half_height, const Ray& ray,
                                     double t_min, double t_max) {
    std::optional<ShapeHit> best;
    const auto take = [&](double t, const dvec3& normal) {
        if (between(t, t_min, best ? best->t : t_max)) best = ShapeHit{t, normal};
    };
    const dvec2 o(ray.origin), d(ray.direction);
    const double a = glm::dot(d, d), b = glm::dot(o, d);
    const double square = b * b - a * (glm::dot(o, o) - radius * radius);
    if (square >= 0 && a > 1e-12) {
        const double t = (-b - std::sqrt(square)) / a;
        const dvec3 p = ray.at(t);
        if (std::abs(p.z) <= half_height) take(t, dvec3(p.x, p.y, 0) / radius);
    }
    const double side = ray.direction.z > 0 ? -1 : 1;
    const double t = (side * half_height - ray.origin.z) / ray.direction.z;
    const dvec3 p = ray.at(t);
    if (p.x * p.x + p.y * p.y <= radius * radius) take(t, dvec3(0, 0, side));
    return best;
}

double distance_to_torus(const dvec3& size, const dvec3& p) {
    return glm::length(dvec2(glm::length(dvec2(p)) - size.x, p.z)) - size.y;
}

double distance_to_cone(const dvec3& size, const dvec3& p) {
    const double r1 = size.x, r2 = size.y, h = size.z;
    const dvec2 q(glm::length(dvec2(p)), p.z), k1(r2, h), k2(r2 - r1, 2 * h);
    const dvec2 ca(q.x - std::min(q.x, q.y < 0 ? r1 : r2), std::abs(q.y) - h);
    const dvec2 cb = q - k1 + k2 * std::clamp(glm::dot(k1 - q, k2) / glm::dot(k2, k2), 0.0, 1.0);
    const double sign = cb.x < 0 && ca.y < 0 ? -1 : 1;
    return sign * std::sqrt(std::min(glm::dot(ca, ca), glm::dot(cb, cb)));
}

// Sphere tracing inside the bounding sphere, for shapes whose distance is easier to compute than
// their roots.
template <class Distance>
std::optional<ShapeHit> march(Distance&& distance, double bound, const Ray& ray, double t_min,
                              double t_max) {
    const double b = glm::dot(ray.origin, ray.direction);
    const double square = b * b - glm::dot(ray.origin, ray.origin) + bound * bound;
    if (square < 0) return std::nullopt;
    double t = std::max(t_min, -b - std::sqrt(square));
    const double end = std::min(t_max, -b + std::sqrt(square));
    for (int step = 0; step < 200 && t < end; ++step) {
        const double d = distance(ray.at(t));
        if (d < 1e-6 && t > t_min) {
            const dvec3 p = ray.at(t);
            const double e = 1e-5;
            const auto slope = [&](const dvec3& axis) {
                return distance(p + e * axis) - distance(p - e * axis);
            };
            const dvec3 n(slope({1, 0, 0}), slope({0, 1, 0}), slope({0, 0, 1}));
            if (glm::dot(n, ray.direction) < 0) return ShapeHit{t, glm::normalize(n)};
        }
        t += std::max(d, 1e-5);
    }
    return std::nullopt;
}

}  // namespace

std::optional<ShapeHit> intersect(Shape shape, const dvec3& size, const Ray& ray, double t_min,
                                  double t_max) {
    const double bound = bounding_radius(shape, size);
    switch (shape) {
        case Shape::sphere:
            return hit_sphere(size.x, ray, t_min, t_max);
        case Shape::box:
            return hit_box(size, ray, t_min, t_max);
        case Shape::cylinder:
            return hit_cylinder(size.x, size.z, ray, t_min, t_max);
        case Shape::cone:
            return march([&](const dvec3& p) { return distance_to_cone(size, p); }, bound, ray,
                         t_min, t_max);
        case Shape::torus:
            return march([&](const dvec3& p) { return distance_to_torus(size, p); }, bound, ray,
                         t_min, t_max);
    }
    return std::nullopt;
}

double bounding_radius(Shape shape, const dvec3& size) {
    switch (shape) {
        case Shape::sphere:
            return size.x;
        case Shape::box:
            return glm::length(size);
        case Shape::cylinder:
            return glm::length(dvec2(size.x, size.z));
        case Shape::cone:
            return glm::length(dvec2(std::max(size.x, size.y), size.z));
        case Shape::torus:
            return size.x + size.y;
    }
    return 0;
}

namespace {

using glm::dvec2;
using glm::dvec3;

// A hash of one lattice point, in [0, 1).
double lattice(int x, int y, int z) {
    auto h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^
             static_cast<std::uint32_t>(y) * 0xd8163841u ^
             static_cast<std::uint32_t>(z) * 0xcb1ab31fu;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12)) * 0x297a2d39u;
    return (h ^ (h >> 15)) * 0x1p-32;
}

int floor_int(double v) {
    return static_cast<int>(std::floor(v));
}

double step(double low, double high, double v) {
    return glm::smoothstep(low, high, v);
}

dvec3 wood(const dvec3& p, const dvec3& a, const dvec3& b, double period) {
    const dvec3 bent = p + 0.5 * period * dvec3(fbm(p * 3.0, 3), fbm(p * 3.0 + 7.0, 3), 0);
    const double ring = glm::length(dvec2(bent.y + 0.4, bent.z + 0.7)) / period;
    const double grain = fbm(dvec3(p.x * 3, p.y * 40, p.z * 40), 2);
    const double saw = ring - std::floor(ring);
    return glm::mix(a, b, std::clamp(0.75 * saw * saw + 0.35 * (grain - 0.3), 0.0, 1.0));
}

dvec3 marble(const dvec3& p, const dvec3& a, const dvec3& b, double period) {
    const double phase = (p.x + 0.6 * p.y + 0.8 * p.z) / period + 2.2 * fbm(p / period, 4);
    const double vein = std::pow(std::abs(std::sin(0.5 * kTau * phase)), 0.35);
    return glm::mix(b, a, vein) * (0.85 + 0.2 * fbm(p * 4.0 / period, 2));
}

dvec3 dots(const dvec3& p, const dvec3& n, const dvec3& a, const dvec3& b, double period) {
    const dvec3 size = glm::abs(n);
    const dvec2 q = size.x > size.y && size.x > size.z ? dvec2(p.y, p.z)
                    : size.y > size.z                  ? dvec2(p.x, p.z)
                                                       : dvec2(p.x, p.y);
    const dvec2 cell = glm::fract(q / period) - 0.5;
    return glm::length(cell) < 0.3 ? b : a;
}

// Stone tiles, each in its own shade, with grout between them.
dvec3 tiles(const dvec3& p, const dvec3& a, const dvec3& b, double period) {
    const dvec2 q = dvec2(p) / period;
    const dvec2 edge = 0.5 - glm::abs(glm::fract(q) - 0.5);
    const double shade = lattice(floor_int(q.x), floor_int(q.y), 5);
    const bool odd = ((floor_int(q.x) + floor_int(q.y)) & 1) != 0;
    const double stain = 0.86 + 0.28 * fbm(p * 3.0, 3);
    const dvec3 stone = glm::mix(a, b, odd ? 0.75 + 0.25 * shade : 0.25 * shade) * stain;
    return glm::mix(dvec3(0.30, 0.28, 0.26), stone, step(0.02, 0.035, std::min(edge.x, edge.y)));
}

}  // namespace

double noise(const dvec3& p) {
    const int x = floor_int(p.x), y = floor_int(p.y), z = floor_int(p.z);
    dvec3 f = glm::fract(p);
    f = f * f * (3.0 - 2.0 * f);
    const auto edge = [&](int dy, int dz) {
        return glm::mix(lattice(x, y + dy, z + dz), lattice(x + 1, y + dy, z + dz), f.x);
    };
    return glm::mix(glm::mix(edge(0, 0), edge(1, 0), f.y), glm::mix(edge(0, 1), edge(1, 1), f.y),
                    f.z);
}

double fbm(dvec3 p, int octaves) {
    double sum = 0, weight = 0.5;
    for (int i = 0; i < octaves; ++i, weight *= 0.5, p = p * 2.03 + 11.7) sum += weight * noise(p);
    return sum;
}

dvec3 albedo(Texture texture, const dvec3& p, const dvec3& n, const dvec3& a, const dvec3& b,
             double period) {
    const double turn = std::atan2(p.y, p.x) / kTau + 0.5;
    switch (texture) {
        case Texture::plain:
            return a;
        case Texture::checker: {
            const dvec3 inner = p - 1e-4 * n;  // clear of the cell border on the face itself
            const int parity = floor_int(inner.x / period) + floor_int(inner.y / period) +
                               floor_int(inner.z / period);
            return (parity & 1) != 0 ? a : b;
        }
        case Texture::wood:
            return wood(p, a, b, period);
        case Texture::marble:
            return marble(p, a, b, period);
        case Texture::stripes:
            return std::fmod(turn / period, 1.0) < 0.5 ? a : b;
        case Texture::beach_ball: {
            const dvec3 colours[] = {
                a, {0.9, 0.88, 0.82}, b, {0.9, 0.88, 0.82}, {0.9, 0.62, 0.08}, {0.9, 0.88, 0.82}};
            if (std::abs(n.z) > 0.96) return colours[1];
            return colours[std::min(5, floor_int(turn * 6))];
        }
        case Texture::dots:
            return dots(p, n, a, b, period);
        case Texture::tiles:
            return tiles(p, a, b, period);
    }
    return a;
}

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
