// SPDX-License-Identifier: MIT
#include "engine/mesh/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/on_threads.h"
#include "engine/core/quantile.h"
#include "engine/core/rng.h"
#include "engine/core/text.h"
#include "engine/mesh/surface_search.h"
#include "engine/mesh/topology.h"
#include "engine/scene/point_tree.h"

namespace darb {

namespace {

constexpr std::size_t kMostSamples = 2'000'000;
constexpr std::size_t kPiece = 1024;  // of samples, for a thread
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// What is found from a sample: the distance, that with a sign, and the normal there.
struct Match {
    double distance = 0, signed_by = kNaN;
    glm::dvec3 normal{kNaN};
};

glm::dvec3 dvec3_of(const std::array<double, 3>& v) {
    return {v[0], v[1], v[2]};
}

/// A target of searches, in the mesh's frame.
class Target {
  public:
    virtual ~Target() = default;
    virtual Match match(const glm::dvec3& p) const = 0;
};

class SurfaceTarget : public Target {
  public:
    explicit SurfaceTarget(const TriangleMesh& mesh) : mesh_(mesh), search_(mesh) {}
    Match match(const glm::dvec3& p) const override {
        const NearestPoint found = search_.nearest(p);
        const glm::dvec3 cross = face_cross(mesh_, found.face);
        const double length = glm::length(cross);
        if (!(length > 0)) return {found.distance};
        const glm::dvec3 normal = cross / length;
        const double side = glm::dot(p - found.point, normal) < 0 ? -1 : 1;
        return {found.distance, side * found.distance, normal};
    }

  private:
    const TriangleMesh& mesh_;
    SurfaceSearch search_;
};

class PointsTarget : public Target {
  public:
    /// normals: of the points, or empty.
    PointsTarget(const std::vector<glm::dvec3>& points, const std::vector<glm::vec3>& normals)
        : normals_(normals),
          view_{points},
          tree_(3, view_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {
        tree_.buildIndex();
    }
    Match match(const glm::dvec3& p) const override {
        std::uint32_t index = 0;
        double square = 0;
        tree_.knnSearch(&p.x, 1, &index, &square);
        Match match{std::sqrt(square)};
        if (normals_.empty()) return match;
        match.normal = glm::dvec3(normals_[index]);
        match.signed_by = glm::dot(p - view_.points[index], match.normal);
        return match;
    }

  private:
    const std::vector<glm::vec3>& normals_;
    PointsView view_;
    PointTree tree_;
};

class ShapesTarget : public Target {
  public:
    ShapesTarget(const std::vector<PlacedShape>& shapes, const glm::dvec3& origin)
        : shapes_(shapes), origin_(origin) {}
    Match match(const glm::dvec3& p) const override {
        const glm::dvec3 at = p + origin_;
        const double d = signed_distance(shapes_, at);
        glm::dvec3 slope;
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 step(0.0);
            step[axis] = kStep;
            slope[axis] = signed_distance(shapes_, at + step) - signed_distance(shapes_, at - step);
        }
        return {std::abs(d), d, glm::normalize(slope)};
    }

  private:
    static constexpr double kStep = 1e-6;  // world units
    const std::vector<PlacedShape>& shapes_;
    glm::dvec3 origin_;
};

/// Samples that are compared, in the mesh's frame. normal: empty where points have none.
struct Samples {
    std::vector<glm::dvec3> position;
    std::vector<glm::vec3> normal;
};

void keep_counting(const CompareOptions& options, const glm::dvec3& origin, Samples& samples) {
    if (!options.counts) return;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < samples.position.size(); ++i) {
        if (!options.counts(samples.position[i] + origin)) continue;
        samples.position[kept] = samples.position[i];
        if (!samples.normal.empty()) samples.normal[kept] = samples.normal[i];
        ++kept;
    }
    samples.position.resize(kept);
    if (!samples.normal.empty()) samples.normal.resize(kept);
}

/// The first point of each cell of side `spacing`.
Samples thinned_points(const TriangleMesh& points, const glm::dvec3& shift, double spacing) {
    struct Cell {
        std::array<std::int64_t, 3> at;
        std::uint32_t point;
    };
    std::vector<Cell> cells(points.vertex_count());
    for (std::uint32_t i = 0; i < cells.size(); ++i) {
        const glm::dvec3 p = glm::floor((glm::dvec3(points.position[i]) + shift) / spacing);
        for (int c = 0; c < 3; ++c)
            cells[i].at[static_cast<std::size_t>(c)] =
                static_cast<std::int64_t>(std::clamp(p[c], -9e18, 9e18));
        cells[i].point = i;
    }
    std::sort(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) {
        return a.at != b.at ? a.at < b.at : a.point < b.point;
    });
    Samples samples;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        if (i > 0 && cells[i].at == cells[i - 1].at) continue;
        samples.position.push_back(glm::dvec3(points.position[cells[i].point]) + shift);
        if (!points.normal.empty()) samples.normal.push_back(points.normal[cells[i].point]);
    }
    return samples;
}

std::vector<Match> match_all(const std::vector<glm::dvec3>& points, const Target& target) {
    std::vector<Match> matches(points.size());
    in_pieces(points.size(), kPiece, [&](std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i) matches[i] = target.match(points[i]);
    });
    return matches;
}

DistanceStatistics statistics_of(const std::vector<Match>& matches) {
    DistanceStatistics result;
    result.samples = matches.size();
    if (matches.empty()) return result;
    std::vector<double> sorted;
    for (const Match& match : matches) sorted.push_back(match.distance);
    std::sort(sorted.begin(), sorted.end());
    for (const double d : sorted) result.mean += d / static_cast<double>(sorted.size());
    result.median = quantile(sorted, 0.5);
    result.p90 = quantile(sorted, 0.9);
    result.largest = sorted.back();
    return result;
}

double share_within(const std::vector<Match>& matches, double threshold) {
    const auto within = std::count_if(matches.begin(), matches.end(), [&](const Match& match) {
        return match.distance <= threshold;
    });
    return matches.empty() ? 0 : static_cast<double>(within) / static_cast<double>(matches.size());
}

struct Trimmed {
    double mean = 0;
    std::size_t left_out = 0;
};

Trimmed trimmed_mean(const std::vector<Match>& matches, double most) {
    Trimmed result;
    double sum = 0;
    for (const Match& match : matches)
        if (most > 0 && match.distance > most)
            ++result.left_out;
        else
            sum += match.distance;
    const std::size_t kept = matches.size() - result.left_out;
    result.mean = kept > 0 ? sum / static_cast<double>(kept) : kNaN;
    return result;
}

/// Bias and angle of the samples that have a normal on both sides.
void compare_normals(const Samples& samples, const std::vector<Match>& matches,
                     MeshComparison& result) {
    double bias = 0, degrees = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < matches.size(); ++i) {
        const double cosine = std::abs(glm::dot(glm::dvec3(samples.normal[i]), matches[i].normal));
        if (std::isnan(cosine) || std::isnan(matches[i].signed_by)) continue;
        bias += matches[i].signed_by;
        degrees += glm::degrees(std::acos(std::min(cosine, 1.0)));
        ++count;
    }
    result.bias = count > 0 ? bias / static_cast<double>(count) : kNaN;
    result.normal_degrees = count > 0 ? degrees / static_cast<double>(count) : kNaN;
}

double extent_of(const std::vector<glm::dvec3>& points) {
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
    for (const glm::dvec3& p : points) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    return points.empty() ? 0 : glm::length(high - low);
}

/// At most this many of the samples, evenly.
std::vector<glm::dvec3> a_few(const std::vector<glm::dvec3>& samples) {
    constexpr std::size_t kFew = 1000;
    std::vector<glm::dvec3> few;
    const std::size_t step = std::max<std::size_t>(1, samples.size() / kFew);
    for (std::size_t i = 0; i < samples.size(); i += step) few.push_back(samples[i]);
    return few;
}

/// Looks before anything is cut to what cameras see, as nothing of such a reference would be left.
void refuse_far_reference(const Samples& ours, const Target& reference, const Samples& theirs,
                          const Target& mesh, const CompareOptions& options,
                          const std::string& where) {
    if (!(options.far_off > 0)) return;
    const double to_reference = statistics_of(match_all(a_few(ours.position), reference)).median,
                 to_mesh = statistics_of(match_all(a_few(theirs.position), mesh)).median;
    if (to_reference <= options.far_off || to_mesh <= options.far_off) return;
    const double our_extent = extent_of(ours.position), their_extent = extent_of(theirs.position);
    const double ratio = their_extent / our_extent;
    throw Error(where,
                fmt::format("half of it lies more than {:.4g} from the mesh; it is {:.4g} across, "
                            "the mesh {:.4g}",
                            to_mesh, their_extent, our_extent),
                ratio > 300 && ratio < 3000
                    ? "Is it in mm, and the scene in metres? Scale one to the other."
                : ratio > 1.0 / 3000 && ratio < 1.0 / 300
                    ? "Is the scene in mm, and it in metres? Scale one to the other."
                    : "Bring it into the frame of the scene: its axes, origin and scale.");
}

Samples samples_of(const TriangleMesh& mesh, double& spacing) {
    SurfaceSamples sampled = sample_surface(mesh, spacing);
    return {std::move(sampled.position), std::move(sampled.normal)};
}

void refuse_nothing(const Samples& samples, const char* what, const std::string& where) {
    if (!samples.position.empty()) return;
    throw Error(where, fmt::format("there is nothing to compare: no sample of {} counts", what),
                "Check that mesh, reference and cameras are in one frame.");
}

void check_options(const TriangleMesh& mesh, const CompareOptions& options,
                   const std::string& where) {
    DARB_CHECK(options.spacing > 0, "{}", options.spacing);
    if (mesh.face_count() == 0)
        throw Error(where, "there is nothing to compare: the mesh has no faces",
                    "Make one with more faces: a larger --voxel, or a smaller --min-island.");
}

}  // namespace

SurfaceSamples sample_surface(const TriangleMesh& mesh, double& spacing) {
    double area = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        area += glm::length(face_cross(mesh, f)) / 2;
    spacing = std::max(spacing, std::sqrt(area / static_cast<double>(kMostSamples)));
    const auto wanted =
        static_cast<std::size_t>(std::max(1.0, std::ceil(area / (spacing * spacing))));
    const double step = area / static_cast<double>(wanted);
    SurfaceSamples samples;
    if (!(area > 0)) return samples;
    Pcg32 rng(0);
    double behind = 0, next = step * rng.uniform();
    std::size_t taken = 0;
    for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
        const glm::dvec3 cross = face_cross(mesh, f);
        const double twice = glm::length(cross);
        behind += twice / 2;
        while (next < behind && taken < wanted) {
            double u = rng.uniform(), v = rng.uniform();
            if (u + v > 1) {
                u = 1 - u;
                v = 1 - v;
            }
            const auto& corner = mesh.face[f];
            const glm::dvec3 a(mesh.position[corner[0]]), b(mesh.position[corner[1]]),
                c(mesh.position[corner[2]]);
            samples.position.push_back(a + u * (b - a) + v * (c - a));
            samples.normal.emplace_back(cross / twice);
            samples.face.push_back(f);
            ++taken;
            next = step * (static_cast<double>(taken) + rng.uniform());
        }
    }
    return samples;
}

MeshComparison compare_meshes(const TriangleMesh& mesh, const TriangleMesh& reference,
                              const CompareOptions& options, const std::string& where) {
    check_options(mesh, options, where);
    const glm::dvec3 origin = dvec3_of(mesh.origin), shift = dvec3_of(reference.origin) - origin;
    MeshComparison result;
    result.spacing = options.spacing;
    Samples ours = samples_of(mesh, result.spacing), theirs;
    std::unique_ptr<Target> target;
    TriangleMesh moved;
    Samples points;  // all of the reference's, which distances are measured to
    if (reference.face_count() > 0) {
        moved = reference;
        for (glm::vec3& p : moved.position) p = glm::vec3(glm::dvec3(p) + shift);
        theirs = samples_of(moved, result.spacing);
        target = std::make_unique<SurfaceTarget>(moved);
    } else {
        for (const glm::vec3& p : reference.position)
            points.position.push_back(glm::dvec3(p) + shift);
        theirs = thinned_points(reference, shift, result.spacing);
        target = std::make_unique<PointsTarget>(points.position, reference.normal);
    }
    refuse_nothing(theirs, "the reference", where);
    const SurfaceTarget surface(mesh);
    refuse_far_reference(ours, *target, theirs, surface, options, where);
    keep_counting(options, origin, ours);
    keep_counting(options, origin, theirs);
    refuse_nothing(ours, "the mesh", where);
    refuse_nothing(theirs, "the reference", where);
    const std::vector<Match> to_reference = match_all(ours.position, *target),
                             to_mesh = match_all(theirs.position, surface);
    result.accuracy = statistics_of(to_reference);
    result.completeness = statistics_of(to_mesh);
    compare_normals(ours, to_reference, result);
    const Trimmed a = trimmed_mean(to_reference, options.left_out),
                  b = trimmed_mean(to_mesh, options.left_out);
    result.chamfer = (a.mean + b.mean) / 2;
    result.left_out_share = static_cast<double>(a.left_out + b.left_out) /
                            static_cast<double>(to_reference.size() + to_mesh.size());
    for (const double t : options.thresholds)
        result.f_scores.push_back({t, share_within(to_reference, t), share_within(to_mesh, t)});
    return result;
}

MeshComparison compare_with_shapes(const TriangleMesh& mesh, const std::vector<PlacedShape>& shapes,
                                   const CompareOptions& options, const std::string& where) {
    check_options(mesh, options, where);
    const glm::dvec3 origin = dvec3_of(mesh.origin);
    MeshComparison result;
    result.spacing = options.spacing;
    Samples ours = samples_of(mesh, result.spacing);
    keep_counting(options, origin, ours);
    refuse_nothing(ours, "the mesh", where);
    const std::vector<Match> matches = match_all(ours.position, ShapesTarget(shapes, origin));
    result.accuracy = statistics_of(matches);
    compare_normals(ours, matches, result);
    const Trimmed trimmed = trimmed_mean(matches, options.left_out);
    result.chamfer = trimmed.mean;
    result.left_out_share =
        static_cast<double>(trimmed.left_out) / static_cast<double>(matches.size());
    for (const double t : options.thresholds)
        result.f_scores.push_back({t, share_within(matches, t), kNaN});
    return result;
}

// Exact shapes. Source of the forms: Quilez, "Distance functions" (iquilezles.org).

namespace {

using glm::dvec2;
using glm::dvec3;

double distance_to_box(const dvec3& half, const dvec3& p) {
    const dvec3 q = glm::abs(p) - half;
    return glm::length(glm::max(q, dvec3(0.0))) + std::min(std::max({q.x, q.y, q.z}), 0.0);
}

double distance_to_cylinder(double radius, double half_height, const dvec3& p) {
    const dvec2 q(glm::length(dvec2(p)) - radius, std::abs(p.z) - half_height);
    return std::min(std::max(q.x, q.y), 0.0) + glm::length(glm::max(q, dvec2(0.0)));
}

double distance_to_cone(const dvec3& size, const dvec3& p) {
    const double r1 = size.x, r2 = size.y, h = size.z;
    const dvec2 q(glm::length(dvec2(p)), p.z), k1(r2, h), k2(r2 - r1, 2 * h);
    const dvec2 cap(q.x - std::min(q.x, q.y < 0 ? r1 : r2), std::abs(q.y) - h);
    const dvec2 side = q - k1 + k2 * std::clamp(glm::dot(k1 - q, k2) / glm::dot(k2, k2), 0.0, 1.0);
    const double sign = side.x < 0 && cap.y < 0 ? -1 : 1;
    return sign * std::sqrt(std::min(glm::dot(cap, cap), glm::dot(side, side)));
}

constexpr const char* kShapeNames[] = {"sphere", "box", "cylinder", "cone", "torus", "plane"};

dvec3 vector_from(const nlohmann::json& numbers) {
    return {numbers.at(0).get<double>(), numbers.at(1).get<double>(), numbers.at(2).get<double>()};
}

PlacedShape shape_from(const nlohmann::json& object, const std::string& place) {
    PlacedShape shape;
    const std::string name = object.at("shape").get<std::string>();
    const auto* const found = std::find(std::begin(kShapeNames), std::end(kShapeNames), name);
    if (found == std::end(kShapeNames))
        throw Error(place, "has the unknown shape '" + printable(name) + "'",
                    "Known are sphere, box, cylinder, cone, torus and plane.");
    shape.kind = static_cast<ShapeKind>(found - std::begin(kShapeNames));
    shape.size = vector_from(object.at("size"));
    shape.position = vector_from(object.at("position"));
    for (int row = 0; row < 3; ++row) {
        const dvec3 values = vector_from(object.at("rotation").at(static_cast<std::size_t>(row)));
        for (int column = 0; column < 3; ++column) shape.rotation[column][row] = values[column];
    }
    const glm::dmat3 error = glm::transpose(shape.rotation) * shape.rotation - glm::dmat3(1.0);
    for (int k = 0; k < 9; ++k)
        if (!(std::abs(error[k / 3][k % 3]) < 1e-6))
            throw Error(place,
                        "its rotation is none: the rows are not at right angles, of length 1",
                        "Give the rows of a rotation matrix.");
    return shape;
}

}  // namespace

double signed_distance(const PlacedShape& shape, const glm::dvec3& point) {
    const dvec3 p = (point - shape.position) * shape.rotation, size = shape.size;
    switch (shape.kind) {
        case ShapeKind::sphere:
            return glm::length(p) - size.x;
        case ShapeKind::box:
            return distance_to_box(size, p);
        case ShapeKind::cylinder:
            return distance_to_cylinder(size.x, size.z, p);
        case ShapeKind::cone:
            return distance_to_cone(size, p);
        case ShapeKind::torus:
            return glm::length(dvec2(glm::length(dvec2(p)) - size.x, p.z)) - size.y;
        case ShapeKind::plane:
            return p.z;
    }
    return kNaN;
}

double signed_distance(const std::vector<PlacedShape>& shapes, const glm::dvec3& point) {
    double least = std::numeric_limits<double>::infinity();
    for (const PlacedShape& shape : shapes) least = std::min(least, signed_distance(shape, point));
    return least;
}

std::vector<PlacedShape> read_shapes(const std::filesystem::path& path) {
    const std::string where = path.string();
    constexpr const char* kHint = "make_scene surface writes such files.";
    const nlohmann::json file = parse_json_text(read_text_file(path), where, kHint);
    try {
        std::vector<PlacedShape> shapes;
        for (const nlohmann::json& object : file.at("shapes"))
            shapes.push_back(shape_from(object, fmt::format("{}, shape {}", where, shapes.size())));
        if (shapes.empty()) throw Error(where, "has no shapes", kHint);
        return shapes;
    } catch (const nlohmann::json::exception& error) {
        throw Error(where, json_reason(error), kHint);
    }
}

std::string format_shapes(const std::vector<PlacedShape>& shapes) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const PlacedShape& shape : shapes) {
        nlohmann::ordered_json rows = nlohmann::ordered_json::array();
        for (int r = 0; r < 3; ++r)
            rows.push_back({shape.rotation[0][r], shape.rotation[1][r], shape.rotation[2][r]});
        list.push_back({{"shape", kShapeNames[static_cast<int>(shape.kind)]},
                        {"size", {shape.size.x, shape.size.y, shape.size.z}},
                        {"position", {shape.position.x, shape.position.y, shape.position.z}},
                        {"rotation", rows}});
    }
    return nlohmann::ordered_json{{"shapes", list}}.dump(1) + "\n";
}

}  // namespace darb
