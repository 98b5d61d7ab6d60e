// SPDX-License-Identifier: MIT
#include "tools/lab/make_scene/surface.h"

#include <algorithm>
#include <cmath>

#include "engine/core/files.h"
#include "engine/core/on_threads.h"
#include "engine/mesh/mesh_file.h"

namespace darb::make_scene {

namespace {

using glm::dvec3;

struct SurfacePoint {
    dvec3 position, normal;
};

dvec3 around(double angle, double radius, double z) {
    return {radius * std::cos(angle), radius * std::sin(angle), z};
}

/// A place on a disc around the axis, which faces up or down.
SurfacePoint on_disc(double radius, double z, double up, Pcg32& rng) {
    const double angle = kTau * rng.uniform();
    return {around(angle, radius * std::sqrt(rng.uniform()), z), dvec3(0, 0, up)};
}

/// The side of a cone or cylinder from radius r1 at -h to r2 at h.
SurfacePoint on_side(double r1, double r2, double h, Pcg32& rng) {
    const double angle = kTau * rng.uniform(), u = rng.uniform();
    // The density of the height is that of its circle: t from the roots of a square.
    const double t = std::abs(r1 - r2) < 1e-12
                         ? u
                         : (r1 - std::sqrt(r1 * r1 + u * (r2 * r2 - r1 * r1))) / (r1 - r2);
    const dvec3 normal = glm::normalize(around(angle, 2 * h, r1 - r2));
    return {around(angle, r1 + t * (r2 - r1), h * (2 * t - 1)), normal};
}

SurfacePoint on_box(const dvec3& half, Pcg32& rng) {
    const double areas[3] = {half.y * half.z, half.x * half.z, half.x * half.y};
    double at = rng.uniform() * (areas[0] + areas[1] + areas[2]);
    int axis = 0;
    while (axis < 2 && at >= areas[axis]) at -= areas[axis++];
    dvec3 p, normal(0.0);
    for (int c = 0; c < 3; ++c) p[c] = half[c] * rng.uniform(-1, 1);
    normal[axis] = rng.below(2) == 0 ? -1 : 1;
    p[axis] = normal[axis] * half[axis];
    return {p, normal};
}

SurfacePoint on_torus(double ring, double tube, Pcg32& rng) {
    const double a = kTau * rng.uniform();
    double b = kTau * rng.uniform();
    while (rng.uniform() * (ring + tube) > ring + tube * std::cos(b)) b = kTau * rng.uniform();
    const dvec3 normal = around(a, std::cos(b), std::sin(b));
    return {around(a, ring, 0) + tube * normal, normal};
}

SurfacePoint on_sphere(double radius, Pcg32& rng) {
    const double z = rng.uniform(-1, 1);
    const dvec3 normal = around(kTau * rng.uniform(), std::sqrt(1 - z * z), z);
    return {radius * normal, normal};
}

double area_of_cone(const dvec3& size) {
    return kTau / 2 * (size.x + size.y) * std::hypot(size.x - size.y, 2 * size.z);
}
double area_of_disc(double radius) {
    return kTau / 2 * radius * radius;
}

double area_of(const PlacedShape& shape, double floor) {
    const dvec3& s = shape.size;
    switch (shape.kind) {
        case ShapeKind::sphere:
            return 2 * kTau * s.x * s.x;
        case ShapeKind::box:
            return 8 * (s.x * s.y + s.y * s.z + s.z * s.x);
        case ShapeKind::cylinder:
            return area_of_cone({s.x, s.x, s.z}) + 2 * area_of_disc(s.x);
        case ShapeKind::cone:
            return area_of_cone(s) + area_of_disc(s.x) + area_of_disc(s.y);
        case ShapeKind::torus:
            return kTau * kTau * s.x * s.y;
        case ShapeKind::plane:
            return area_of_disc(floor);
    }
    return 0;
}

/// In the shape's frame.
SurfacePoint sample(const PlacedShape& shape, double floor, Pcg32& rng) {
    const dvec3& s = shape.size;
    switch (shape.kind) {
        case ShapeKind::sphere:
            return on_sphere(s.x, rng);
        case ShapeKind::box:
            return on_box(s, rng);
        case ShapeKind::torus:
            return on_torus(s.x, s.y, rng);
        case ShapeKind::plane:
            return on_disc(floor, 0, 1, rng);
        case ShapeKind::cylinder:
        case ShapeKind::cone:
            break;
    }
    const double top = shape.kind == ShapeKind::cylinder ? s.x : s.y;
    const double at = rng.uniform() * area_of(shape, floor);
    if (at < area_of_disc(s.x)) return on_disc(s.x, -s.z, -1, rng);
    if (at < area_of_disc(s.x) + area_of_disc(top)) return on_disc(top, s.z, 1, rng);
    return on_side(s.x, top, s.z, rng);
}

constexpr double kClear = 1e-4;  // world units, between a surface and what would hide it

bool sees(const World& world, const Camera& camera, const SurfacePoint& point) {
    const dvec3 eye = camera.centre(), to = point.position - eye;
    if (glm::dot(to, point.normal) >= 0) return false;
    const dvec3 local = camera.rotation * point.position + camera.translation;
    if (local.z <= 0) return false;
    const double x = camera.fx * local.x / local.z + camera.cx,
                 y = camera.fy * local.y / local.z + camera.cy;
    if (x < 0 || x > camera.width || y < 0 || y > camera.height) return false;
    const double distance = glm::length(to);
    return depth_along(world, {eye, to / distance}) > distance - kClear;
}

bool two_see(const World& world, const std::vector<View>& views, const SurfacePoint& point) {
    int seen = 0;
    for (const View& view : views)
        if (!view.is_test && sees(world, view.camera, point) && ++seen == 2) return true;
    return false;
}

}  // namespace

std::vector<PlacedShape> shapes_of(const World& world) {
    std::vector<PlacedShape> shapes;
    for (const Object& object : world.objects) {
        PlacedShape& shape = shapes.emplace_back();
        switch (object.shape) {
            case Shape::sphere:
                shape.kind = ShapeKind::sphere;
                break;
            case Shape::box:
                shape.kind = ShapeKind::box;
                break;
            case Shape::cylinder:
                shape.kind = ShapeKind::cylinder;
                break;
            case Shape::cone:
                shape.kind = ShapeKind::cone;
                break;
            case Shape::torus:
                shape.kind = ShapeKind::torus;
                break;
        }
        shape.size = object.size;
        shape.position = object.position;
        shape.rotation = object.rotation;
    }
    shapes.push_back({ShapeKind::plane, dvec3(0.0), dvec3(0, 0, world.floor_z)});
    return shapes;
}

TriangleMesh surface_points(const World& world, const std::vector<View>& views,
                            const SurfaceSettings& settings) {
    Pcg32 rng(0);
    std::vector<SurfacePoint> points;
    for (const PlacedShape& shape : shapes_of(world)) {
        const double area = area_of(shape, settings.floor);
        const long count = std::lround(area / (settings.spacing * settings.spacing));
        for (long i = 0; i < count; ++i) {
            const SurfacePoint local = sample(shape, settings.floor, rng);
            points.push_back(
                {shape.position + shape.rotation * local.position, shape.rotation * local.normal});
        }
    }
    std::vector<std::uint8_t> seen(points.size(), 0);
    in_pieces(points.size(), 1024, [&](std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i)
            seen[i] = two_see(world, views, points[i]);
    });
    TriangleMesh mesh;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!seen[i]) continue;
        mesh.position.emplace_back(points[i].position);
        mesh.normal.emplace_back(points[i].normal);
    }
    return mesh;
}

void write_surface(const std::filesystem::path& folder, const World& world,
                   const std::vector<View>& views, const SurfaceSettings& settings) {
    write_mesh(folder / "surface.ply", surface_points(world, views, settings));
    write_file_atomic(folder / "shapes.json", format_shapes(shapes_of(world)));
}

}  // namespace darb::make_scene
