// SPDX-License-Identifier: MIT
// How far a mesh is from a reference: a mesh, points, or shapes whose distance is exact. The
// accuracy goes from the mesh to the reference, the completeness back. Source of the measures: DTU
// (mean of both distances), Tanks and Temples (F-score at a threshold).
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "engine/mesh/triangle_mesh.h"

namespace darb {

struct CompareOptions {
    double spacing = 0;              // between samples of a surface, and least one of points; > 0
    std::vector<double> thresholds;  // of the F-score, world units
    double left_out = 0;             // distances beyond this do not count in `chamfer`; 0: all do
    double far_off = 0;  // where half of the samples of both sides are farther from the other side
                         // than this, the reference is refused; 0: none is
    /// Whether a world point counts: that the cameras see it. Empty: all do.
    std::function<bool(const glm::dvec3& point)> counts = {};
};

/// Distances in world units.
struct DistanceStatistics {
    std::size_t samples = 0;
    double mean = 0, median = 0, p90 = 0, largest = 0;
};

struct FScore {
    double threshold = 0;
    double precision = 0, recall = 0;  // shares of samples within the threshold
    double f() const {
        const double sum = precision + recall;
        return sum > 0 ? 2 * precision * recall / sum : 0;
    }
};

struct MeshComparison {
    DistanceStatistics accuracy, completeness;
    /// Mean signed distance to the reference, positive on the side of its normals; NaN where it has
    /// none.
    double bias = 0;
    double chamfer = 0;         // mean of the means of both distances, without those left out
    double left_out_share = 0;  // of all samples
    /// Mean angle between the mesh's normal and the reference's line of normal, degrees, 0 to 90;
    /// NaN where the reference has no normals.
    double normal_degrees = 0;
    std::vector<FScore> f_scores;  // one for each threshold
    double spacing = 0;            // as it was taken: larger where there were too many samples
};

/// reference: a mesh, or points where it has no faces. Surfaces are sampled evenly by area (seed
/// 0), points are thinned to the spacing. Distances to a mesh are exact, to its faces; to points,
/// those to the nearest one. Samples of both sides for which counts() is false are left out. where:
/// names the reference in errors. Throws Error where nothing is left to compare, or the reference
/// is too far away.
MeshComparison compare_meshes(const TriangleMesh& mesh, const TriangleMesh& reference,
                              const CompareOptions& options, const std::string& where);

enum class ShapeKind { sphere, box, cylinder, cone, torus, plane };

/// A shape in its own frame, centred on 0 and with its axis along z, and where that frame is.
struct PlacedShape {
    ShapeKind kind = ShapeKind::sphere;
    /// sphere (radius, -, -); box half extents; cylinder (radius, -, half height); cone (base
    /// radius, top radius, half height), base down; torus (ring radius, tube radius, -); plane
    /// z = 0. World units.
    glm::dvec3 size{1.0};
    glm::dvec3 position{0.0};
    glm::dmat3 rotation{1.0};  // to the world
};

/// Exact distance of a world point to the surface, negative inside (below the plane).
double signed_distance(const PlacedShape& shape, const glm::dvec3& point);
/// Of the union: exact outside; inside of several, how far the nearest surface is at least.
double signed_distance(const std::vector<PlacedShape>& shapes, const glm::dvec3& point);

/// The samples of the mesh against exact shapes: `accuracy`, `bias`, `normal_degrees` and the
/// precisions of the F-scores; `completeness` has no samples.
MeshComparison compare_with_shapes(const TriangleMesh& mesh, const std::vector<PlacedShape>& shapes,
                                   const CompareOptions& options, const std::string& where);

/// [{"shape": "box", "size": [3], "position": [3], "rotation": [[3], [3], [3]] rows}, ...] under
/// the key "shapes". Throws Error naming file, place, reason and remedy.
std::vector<PlacedShape> read_shapes(const std::filesystem::path& path);
std::string format_shapes(const std::vector<PlacedShape>& shapes);

/// Points, normals and faces of a surface, evenly by area: one in each of equal pieces of it, laid
/// one after the other. `spacing` is enlarged where there would be more than 2 million.
struct SurfaceSamples {
    std::vector<glm::dvec3> position;  // in the mesh's frame
    std::vector<glm::vec3> normal;     // of the face, unit length
    std::vector<std::uint32_t> face;
};
SurfaceSamples sample_surface(const TriangleMesh& mesh, double& spacing);

}  // namespace darb
