// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/error.h"
#include "engine/mesh/texture.h"
#include "engine/mesh/topology.h"

namespace darb {

namespace {

using glm::dvec3;

// The unknowns: a colour for each photo that paints a face at a vertex.
class PaintedVertices {
  public:
    PaintedVertices(const TriangleMesh& mesh, const PhotoChoice& choice)
        : mesh_(mesh), choice_(choice) {
        for (std::uint32_t f = 0; f < mesh.face_count(); ++f)
            if (choice.view[f] != kNoPhoto)
                for (std::size_t c = 0; c < 3; ++c) key_.push_back(key_of(f, c));
        std::sort(key_.begin(), key_.end());
        key_.erase(std::unique(key_.begin(), key_.end()), key_.end());
    }

    std::size_t count() const { return key_.size(); }
    /// That of a corner of a face with a photo.
    int at(std::uint32_t face, std::size_t corner) const {
        const auto found = std::lower_bound(key_.begin(), key_.end(), key_of(face, corner));
        return static_cast<int>(found - key_.begin());
    }

  private:
    std::uint64_t key_of(std::uint32_t face, std::size_t corner) const {
        return std::uint64_t{mesh_.face[face][corner]} << 32 | choice_.view[face];
    }

    const TriangleMesh& mesh_;
    const PhotoChoice& choice_;
    std::vector<std::uint64_t> key_;  // vertex and view, ascending
};

/// What a photo shows along one side of a seam: the mean colours towards the two ends of the
/// half-edge, each sample weighted by how near it is to that end.
struct SeamSide {
    std::uint32_t half = 0;
    dvec3 start{0.0}, end{0.0};
};
struct Seam {
    SeamSide side[2];
};

std::vector<Seam> seams_of(const TriangleMesh& mesh, const PhotoChoice& choice) {
    const std::vector<std::uint32_t> twin = pair_half_edges(mesh).twin;
    std::vector<Seam> seams;
    for (std::uint32_t half = 0; half < twin.size(); ++half) {
        const std::uint32_t other = twin[half];
        if (other == kNoHalfEdge || half > other) continue;
        const std::uint32_t a = choice.view[half / 3], b = choice.view[other / 3];
        if (a != b && a != kNoPhoto && b != kNoPhoto)
            seams.push_back({{{.half = half}, {.half = other}}});
    }
    return seams;
}

void sample(const TriangleMesh& mesh, const Camera& camera, const ImageU8& photo, SeamSide& side) {
    constexpr int kSamples = 8;
    const glm::vec3 from = mesh.position[half_edge_start(mesh, side.half)],
                    to = mesh.position[half_edge_start(mesh, next_half_edge(side.half))];
    side.start = side.end = dvec3(0.0);
    double start_weight = 0, end_weight = 0;
    for (int i = 0; i < kSamples; ++i) {
        const double t = (i + 0.5) / kSamples;
        const auto colour =
            photo_colour(camera, photo, mesh, glm::mix(from, to, static_cast<float>(t)));
        if (!colour) continue;
        side.start += (1 - t) * *colour;
        start_weight += 1 - t;
        side.end += t * *colour;
        end_weight += t;
    }
    if (start_weight > 0) side.start /= start_weight;
    if (end_weight > 0) side.end /= end_weight;
}

/// A wish for the difference of two unknowns.
struct Wish {
    int first = 0, second = 0;
    dvec3 difference{0.0};  // first - second, levels
    double weight = 0;
};

/// At both ends of every seam what is added shall make the photos meet.
std::vector<Wish> wishes_of(const std::vector<Seam>& seams, const PaintedVertices& vertices) {
    // Beyond so many levels it is not the exposure that differs but what the photos show, by a
    // surface or a camera that is not exact.
    constexpr double kOfExposure = 24;
    std::vector<Wish> wishes;
    const auto corner = [&](std::uint32_t half) { return vertices.at(half / 3, half % 3); };
    for (const Seam& seam : seams) {
        const SeamSide &a = seam.side[0], &b = seam.side[1];
        for (const bool at_start : {true, false}) {
            Wish wish;
            wish.first = corner(at_start ? a.half : next_half_edge(a.half));
            wish.second = corner(at_start ? next_half_edge(b.half) : b.half);
            wish.difference = at_start ? b.end - a.start : b.start - a.end;
            const dvec3 size = glm::abs(wish.difference);
            const double share =
                std::min(1.0, kOfExposure / std::max({size.x, size.y, size.z, 1.0}));
            wish.weight = share * share;
            wishes.push_back(wish);
        }
    }
    return wishes;
}

/// The colours of least squares for the wishes, for changes along edges within a photo that are as
/// small as can be, and for small colours.
Eigen::MatrixX3d solve(const TriangleMesh& mesh, const PhotoChoice& choice,
                       const PaintedVertices& vertices, const std::vector<Wish>& wishes) {
    constexpr double kSmoothing = 0.1, kOfOneFace = kSmoothing / 2;  // an edge has two faces
    // With a thirtieth of it seams meet as well, but whole objects drift away from their photos.
    constexpr double kSmallness = 3e-3;
    const auto n = static_cast<Eigen::Index>(vertices.count());
    std::vector<Eigen::Triplet<double>> terms;
    Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(n, 3);
    const auto couple = [&](int i, int j, double weight) {
        terms.emplace_back(i, i, weight);
        terms.emplace_back(j, j, weight);
        terms.emplace_back(i, j, -weight);
        terms.emplace_back(j, i, -weight);
    };
    for (int i = 0; i < n; ++i) terms.emplace_back(i, i, kSmallness);
    for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
        if (choice.view[f] == kNoPhoto) continue;
        for (std::size_t c = 0; c < 3; ++c)
            couple(vertices.at(f, c), vertices.at(f, (c + 1) % 3), kOfOneFace);
    }
    for (const Wish& wish : wishes) {
        couple(wish.first, wish.second, wish.weight);
        for (int c = 0; c < 3; ++c) {
            right(wish.first, c) += wish.weight * wish.difference[c];
            right(wish.second, c) -= wish.weight * wish.difference[c];
        }
    }
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(terms.begin(), terms.end());
    Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
    solver.setTolerance(1e-4);
    solver.setMaxIterations(2000);
    solver.compute(matrix);
    return solver.solve(right);
}

}  // namespace

SeamLevels level_seams(const TriangleMesh& mesh, const PhotoViews& views,
                       const PhotoChoice& choice) {
    if (choice.view.size() != mesh.face_count())
        throw Error(
            "choice of photos",
            fmt::format("is for {} faces, the mesh has {}", choice.view.size(), mesh.face_count()),
            "Choose photos for this mesh.");
    SeamLevels levels;
    std::vector<Seam> seams = seams_of(mesh, choice);
    if (seams.empty()) return levels;
    std::vector<std::vector<SeamSide*>> of_view(views.cameras.size());
    for (Seam& seam : seams)
        for (SeamSide& side : seam.side) of_view[choice.view[side.half / 3]].push_back(&side);
    for (std::size_t view = 0; view < of_view.size(); ++view) {
        if (of_view[view].empty()) continue;
        const ImageU8 photo = views.photo(view);
        for (SeamSide* side : of_view[view]) sample(mesh, views.cameras[view], photo, *side);
    }

    const PaintedVertices vertices(mesh, choice);
    const std::vector<Wish> wishes = wishes_of(seams, vertices);
    const Eigen::MatrixX3d colour = solve(mesh, choice, vertices, wishes);
    const auto at = [&](int i) { return dvec3(colour(i, 0), colour(i, 1), colour(i, 2)); };
    for (const Wish& wish : wishes) {
        const dvec3 left = wish.difference - (at(wish.first) - at(wish.second));
        levels.before += glm::dot(glm::abs(wish.difference), dvec3(1.0 / 3));
        levels.after += glm::dot(glm::abs(left), dvec3(1.0 / 3));
    }
    levels.before /= static_cast<double>(wishes.size());
    levels.after /= static_cast<double>(wishes.size());
    levels.added.resize(mesh.face_count());
    for (std::uint32_t f = 0; f < mesh.face_count(); ++f)
        for (std::size_t c = 0; c < 3; ++c)
            levels.added[f][c] =
                choice.view[f] == kNoPhoto ? glm::vec3(0) : glm::vec3(at(vertices.at(f, c)));
    return levels;
}

}  // namespace darb
