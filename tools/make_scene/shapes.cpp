#include "tools/make_scene/shapes.h"

#include <algorithm>
#include <cmath>

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

// Sphere tracing inside the bounding sphere, for shapes whose distance is easier than their roots.
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

}  // namespace darb::make_scene
