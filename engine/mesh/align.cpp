// SPDX-License-Identifier: MIT
#include "engine/mesh/align.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/core/on_threads.h"
#include "engine/mesh/compare.h"
#include "engine/mesh/surface_search.h"
#include "engine/mesh/topology.h"

namespace darb {

namespace {

using glm::dmat3;
using glm::dvec3;

constexpr std::size_t kMostPoints = 20'000;
constexpr int kMostSteps = 80;
constexpr double kSettled = 1e-7;  // of the extent, and of a turn
constexpr double kKept = 0.9;      // of the samples, the nearest: their mean distance is made small
constexpr double kFarthest = 4;    // such means: samples beyond it are left out of a step
constexpr double kDamping = 1e-7;  // of the mean of the diagonal
constexpr std::size_t kUnknowns = 7;  // turn, shift, logarithm of the scale

struct Placement {
    double scale = 1;
    dmat3 rotation{1.0};
    dvec3 shift{0.0};
    dvec3 apply(const dvec3& p) const { return scale * (rotation * p) + shift; }
};

/// Points of the reference in the mesh's frame.
std::vector<dvec3> sampled(const TriangleMesh& reference, const dvec3& shift, double spacing) {
    std::vector<dvec3> points;
    if (reference.face_count() > 0) {
        points = sample_surface(reference, spacing).position;
    } else {
        for (const glm::vec3& p : reference.position) points.emplace_back(p);
    }
    const std::size_t step = (points.size() + kMostPoints - 1) / kMostPoints;
    std::vector<dvec3> few;
    for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(step, 1))
        few.push_back(points[i] + shift);
    return few;
}

std::vector<NearestPoint> nearest_all(const SurfaceSearch& search, const std::vector<dvec3>& points,
                                      const Placement& frame) {
    std::vector<NearestPoint> found(points.size());
    in_pieces(points.size(), 256, [&](std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i)
            found[i] = search.nearest(frame.apply(points[i]));
    });
    return found;
}

/// Mean of the nearest 90 %: a median would be 0 where a shift slides most of a box along itself.
double trimmed_distance(const std::vector<NearestPoint>& found) {
    std::vector<double> distances;
    for (const NearestPoint& one : found) distances.push_back(one.distance);
    std::sort(distances.begin(), distances.end());
    const auto kept =
        std::max<std::size_t>(1, static_cast<std::size_t>(kKept * double(found.size())));
    double sum = 0;
    for (std::size_t i = 0; i < kept; ++i) sum += distances[i];
    return sum / static_cast<double>(kept);
}

struct Spread {
    dvec3 middle{0.0};
    double radius = 0;  // root mean square from the middle
};

Spread spread_of(const std::vector<dvec3>& points) {
    Spread spread;
    const double count = static_cast<double>(points.size());
    for (const dvec3& p : points) spread.middle += p / count;
    for (const dvec3& p : points) {
        const dvec3 d = p - spread.middle;
        spread.radius += glm::dot(d, d) / count;
    }
    spread.radius = std::sqrt(spread.radius);
    return spread;
}

/// Solves a x = b in place by elimination; a is symmetric and positive.
std::array<double, kUnknowns> solved(std::array<std::array<double, kUnknowns + 1>, kUnknowns>& a,
                                     std::size_t unknowns) {
    for (std::size_t i = 0; i < unknowns; ++i) {
        std::size_t best = i;
        for (std::size_t r = i + 1; r < unknowns; ++r)
            if (std::abs(a[r][i]) > std::abs(a[best][i])) best = r;
        std::swap(a[i], a[best]);
        for (std::size_t r = i + 1; r < unknowns; ++r) {
            const double factor = a[r][i] / a[i][i];
            for (std::size_t c = i; c < unknowns; ++c) a[r][c] -= factor * a[i][c];
            a[r][kUnknowns] -= factor * a[i][kUnknowns];
        }
    }
    std::array<double, kUnknowns> x{};
    for (std::size_t i = unknowns; i-- > 0;) {
        double rest = a[i][kUnknowns];
        for (std::size_t c = i + 1; c < unknowns; ++c) rest -= a[i][c] * x[c];
        x[i] = rest / a[i][i];
    }
    return x;
}

dmat3 turned_by(const dvec3& w) {
    const double angle = glm::length(w);
    if (!(angle > 0)) return dmat3(1.0);
    const dvec3 axis = w / angle;
    const dmat3 cross(0, axis.z, -axis.y, -axis.z, 0, axis.x, axis.y, -axis.x, 0);
    return dmat3(1.0) + std::sin(angle) * cross + (1 - std::cos(angle)) * (cross * cross);
}

/// One step of Gauss and Newton; returns how large it was, in extents and radians.
double step_nearer(const TriangleMesh& mesh, const std::vector<dvec3>& points,
                   const std::vector<NearestPoint>& found, double most, AlignKind kind,
                   Placement& frame) {
    std::vector<std::size_t> near;
    std::vector<dvec3> placed;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (found[i].distance > most) continue;
        near.push_back(i);
        placed.push_back(frame.apply(points[i]));
    }
    const Spread spread = spread_of(placed);
    if (near.empty() || !(spread.radius > 0)) return 0;
    const std::size_t unknowns = kind == AlignKind::similarity ? kUnknowns : kUnknowns - 1;
    std::array<std::array<double, kUnknowns + 1>, kUnknowns> sums{};
    for (std::size_t k = 0; k < near.size(); ++k) {
        const dvec3 cross = face_cross(mesh, found[near[k]].face);
        const double length = glm::length(cross);
        if (!(length > 0)) continue;
        const dvec3 normal = cross / length, arm = (placed[k] - spread.middle) / spread.radius;
        const dvec3 turn = glm::cross(arm, normal);
        const std::array<double, kUnknowns> row{
            turn.x, turn.y, turn.z, normal.x, normal.y, normal.z, glm::dot(normal, arm)};
        const double off = glm::dot(normal, placed[k] - found[near[k]].point) / spread.radius;
        for (std::size_t r = 0; r < unknowns; ++r) {
            for (std::size_t c = 0; c < unknowns; ++c) sums[r][c] += row[r] * row[c];
            sums[r][kUnknowns] -= row[r] * off;
        }
    }
    double diagonal = 0;
    for (std::size_t i = 0; i < unknowns; ++i) diagonal += sums[i][i] / double(unknowns);
    for (std::size_t i = 0; i < unknowns; ++i) sums[i][i] += kDamping * diagonal + 1e-300;
    const auto x = solved(sums, unknowns);
    const dmat3 turn = turned_by({x[0], x[1], x[2]});
    const double scale = std::exp(std::clamp(x[6], -0.5, 0.5));
    const dvec3 move = spread.radius * dvec3(x[3], x[4], x[5]);
    frame.shift = scale * (turn * (frame.shift - spread.middle)) + spread.middle + move;
    frame.rotation = turn * frame.rotation;
    frame.scale *= scale;
    double size = 0;
    for (std::size_t i = 0; i < unknowns; ++i) size = std::max(size, std::abs(x[i]));
    return size;
}

/// Where to begin: as the reference is, or with the middles, and for a similarity the radii, of
/// both together, whichever is nearer.
Placement first_frame(const TriangleMesh& mesh, const SurfaceSearch& search,
                      const std::vector<dvec3>& points, AlignKind kind, double spacing) {
    const Placement as_it_is;
    const Spread ours = spread_of(sampled(mesh, dvec3(0.0), spacing)), theirs = spread_of(points);
    Placement together;
    if (kind == AlignKind::similarity && theirs.radius > 0)
        together.scale = ours.radius / theirs.radius;
    together.shift = ours.middle - together.scale * theirs.middle;
    return trimmed_distance(nearest_all(search, points, together)) <
                   trimmed_distance(nearest_all(search, points, as_it_is))
               ? together
               : as_it_is;
}

}  // namespace

std::optional<AlignKind> align_kind_from_name(std::string_view name) {
    if (name == "rigid") return AlignKind::rigid;
    if (name == "similarity") return AlignKind::similarity;
    return std::nullopt;
}

Alignment align_to_mesh(const TriangleMesh& mesh, const TriangleMesh& reference, AlignKind kind,
                        double spacing) {
    DARB_CHECK(mesh.face_count() > 0 && reference.vertex_count() > 0, "{} faces, {} vertices",
               mesh.face_count(), reference.vertex_count());
    const dvec3 origin(mesh.origin[0], mesh.origin[1], mesh.origin[2]);
    const dvec3 theirs(reference.origin[0], reference.origin[1], reference.origin[2]);
    const std::vector<dvec3> points = sampled(reference, theirs - origin, spacing);
    const SurfaceSearch search(mesh);
    Alignment alignment;
    alignment.before = trimmed_distance(nearest_all(search, points, Placement{}));
    Placement frame = first_frame(mesh, search, points, kind, spacing), best = frame;
    double least = std::numeric_limits<double>::infinity();
    for (int step = 0; step < kMostSteps; ++step) {
        const std::vector<NearestPoint> found = nearest_all(search, points, frame);
        const double mean = trimmed_distance(found);
        if (mean < least) {
            least = mean;
            best = frame;
        }
        if (step_nearer(mesh, points, found, kFarthest * mean, kind, frame) < kSettled) break;
    }
    alignment.after = least;
    alignment.scale = best.scale;
    alignment.rotation = best.rotation;
    // From the mesh's frame to the world's.
    alignment.shift = best.shift + origin - best.scale * (best.rotation * origin);
    const double trace = best.rotation[0][0] + best.rotation[1][1] + best.rotation[2][2];
    alignment.degrees = glm::degrees(std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0)));
    const dvec3 middle = spread_of(points).middle + origin;
    alignment.moved = glm::distance(alignment.apply(middle), middle);
    return alignment;
}

TriangleMesh moved_mesh(const Alignment& alignment, TriangleMesh mesh) {
    const dvec3 origin(mesh.origin[0], mesh.origin[1], mesh.origin[2]);
    const dvec3 moved = alignment.apply(origin);
    for (glm::vec3& p : mesh.position)
        p = glm::vec3(alignment.scale * (alignment.rotation * dvec3(p)));
    for (glm::vec3& n : mesh.normal) n = glm::vec3(alignment.rotation * dvec3(n));
    mesh.origin = {moved.x, moved.y, moved.z};
    return mesh;
}

}  // namespace darb
