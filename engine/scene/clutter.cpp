// SPDX-License-Identifier: MIT
#include "engine/scene/clutter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <utility>

#include "engine/core/on_threads.h"
#include "engine/core/quantile.h"
#include "engine/core/union_find.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/merge_splats.h"
#include "engine/scene/point_tree.h"

namespace darb {

namespace {

constexpr std::size_t kAskedNeighbours = 12;  // neighbours that are asked first
constexpr std::size_t kSplatsAtATime = 1024;  // splats of a thread at a time
constexpr std::size_t kFewSplats = 5000;      // of a set whose every neighbour is looked for
constexpr double kTouch2 = 9;                 // squared Mahalanobis distance
constexpr double kMostTimesLarger = 10;       // of two splats that touch

struct Extent {
    glm::dvec3 mean;
    Symmetric3 covariance;
    double largest;  // standard deviation
};

bool touch(const Extent& a, const Extent& b) {
    const double larger = std::max(a.largest, b.largest);
    if (larger > kMostTimesLarger * std::min(a.largest, b.largest)) return false;
    const glm::dvec3 d = b.mean - a.mean;
    if (glm::dot(d, d) > kTouch2 * (a.largest * a.largest + b.largest * b.largest)) return false;
    Symmetric3 s;
    for (std::size_t i = 0; i < s.size(); ++i) s[i] = a.covariance[i] + b.covariance[i];
    // The adjugate of s, row by row; d' s^-1 d = d' adj(s) d / det(s).
    const double xx = s[3] * s[5] - s[4] * s[4], xy = s[2] * s[4] - s[1] * s[5];
    const double xz = s[1] * s[4] - s[2] * s[3], yy = s[0] * s[5] - s[2] * s[2];
    const double yz = s[1] * s[2] - s[0] * s[4], zz = s[0] * s[3] - s[1] * s[1];
    const double det = s[0] * xx + s[1] * xy + s[2] * xz;
    const double form = d.x * d.x * xx + d.y * d.y * yy + d.z * d.z * zz +
                        2 * (d.x * d.y * xy + d.x * d.z * xz + d.y * d.z * yz);
    return form <= kTouch2 * det;
}

/// Those splats of a model that are drawn, with a tree of their means.
class Extents {
  public:
    /// mass: [N], to be filled.
    Extents(const SplatModel& model, std::vector<double>& mass) {
        for (std::size_t i = 0; i < model.size(); ++i) {
            if (!is_finite(model, i) || !has_rotation(model, i)) continue;
            if (sigmoid(double{model.opacity_logit[i]}) < undrawn_below(ALPHA_CUTOFF_DEFAULT))
                continue;
            const SplatMoments m = moments_of(model, i);
            const float* s = &model.log_scale[3 * i];
            splats_.push_back(static_cast<std::uint32_t>(i));
            extents_.push_back(
                {m.mean, m.covariance, std::exp(double{std::max({s[0], s[1], s[2]})})});
            means_.push_back(m.mean);
            mass[i] = m.mass;
        }
        tree_.buildIndex();
    }

    std::size_t size() const { return extents_.size(); }
    std::uint32_t splat(std::size_t i) const { return splats_[i]; }

    /// Joins each splat with those of its nearest neighbours that it touches. A chain of these
    /// holds most of a scene together.
    void join_nearest(UnionFind& sets) const {
        std::vector<std::array<std::uint32_t, kAskedNeighbours + 1>> nearest(size());
        in_pieces(size(), kSplatsAtATime, [&](std::size_t first, std::size_t count) {
            for (std::size_t i = first; i < first + count; ++i) {
                std::array<double, kAskedNeighbours + 1> distance2;
                nearest[i].fill(static_cast<std::uint32_t>(i));
                tree_.knnSearch(&means_[i][0], kAskedNeighbours + 1, nearest[i].data(),
                                distance2.data());
                for (std::uint32_t& j : nearest[i])
                    if (!touch(extents_[i], extents_[j])) j = static_cast<std::uint32_t>(i);
            }
        });
        for (std::size_t i = 0; i < size(); ++i)
            for (const std::uint32_t j : nearest[i]) sets.join(static_cast<std::uint32_t>(i), j);
    }

    /// Joins a splat with everything that it touches.
    void join_all(std::size_t i, UnionFind& sets) const {
        const Extent& e = extents_[i];
        const double larger = kMostTimesLarger * e.largest;
        const double reach2 = kTouch2 * (e.largest * e.largest + larger * larger);
        for_each_within(tree_, e.mean, reach2, [&](std::uint32_t j) {
            if (sets.find(j) != sets.find(static_cast<std::uint32_t>(i)) && touch(e, extents_[j]))
                sets.join(static_cast<std::uint32_t>(i), j);
        });
    }

  private:
    std::vector<std::uint32_t> splats_;
    std::vector<Extent> extents_;
    std::vector<glm::dvec3> means_;
    PointsView view_{means_};
    PointTree tree_{3, view_, nanoflann::KDTreeSingleIndexAdaptorParams(16)};
};

}  // namespace

std::size_t count_of(const SplatSet& set) {
    return static_cast<std::size_t>(std::count(set.begin(), set.end(), 1));
}

SplatParts parts_of_splats(const SplatModel& model) {
    std::vector<double> mass(model.size(), 0.0);
    const Extents extents(model, mass);
    UnionFind sets(extents.size());
    extents.join_nearest(sets);
    // Of small sets all that they touch is looked for, which joins what the nearest neighbours
    // alone left apart. For large ones that would take very long.
    std::vector<std::size_t> members(extents.size(), 0);
    for (std::size_t i = 0; i < extents.size(); ++i) ++members[sets.find(std::uint32_t(i))];
    std::vector<std::size_t> few;
    for (std::size_t i = 0; i < extents.size(); ++i)
        if (members[sets.find(std::uint32_t(i))] < kFewSplats) few.push_back(i);
    for (const std::size_t i : few) extents.join_all(i, sets);
    SplatParts parts;
    constexpr std::uint32_t kNone = ~0u;
    std::vector<std::uint32_t> number(extents.size(), kNone);
    parts.part.assign(model.size(), kNone);
    for (std::size_t i = 0; i < extents.size(); ++i) {
        std::uint32_t& n = number[sets.find(std::uint32_t(i))];
        if (n == kNone) {
            n = static_cast<std::uint32_t>(parts.mass.size());
            parts.mass.push_back(0);
        }
        parts.part[extents.splat(i)] = n;
        parts.mass[n] += mass[extents.splat(i)];
    }
    for (std::uint32_t& part : parts.part) {
        if (part != kNone) continue;
        part = static_cast<std::uint32_t>(parts.mass.size());
        parts.mass.push_back(0);
    }
    return parts;
}

SplatSet isolated_splats(const SplatModel& model, double least_share) {
    SplatSet set(model.size(), 0);
    if (model.size() == 0) return set;
    const SplatParts parts = parts_of_splats(model);
    const double most = *std::max_element(parts.mass.begin(), parts.mass.end());
    for (std::size_t i = 0; i < set.size(); ++i)
        set[i] = parts.mass[parts.part[i]] < least_share * most ? 1 : 0;
    return set;
}

std::vector<double> largest_deviations(const SplatModel& model) {
    std::vector<double> sizes(model.size());
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const float* s = &model.log_scale[3 * i];
        sizes[i] = std::exp(double{std::max({s[0], s[1], s[2]})});
    }
    return sizes;
}

SplatSet hazy_splats(const SplatModel& model, double opacity, double size) {
    SplatSet set(model.size(), 0);
    if (model.size() == 0) return set;
    const std::vector<double> sizes = largest_deviations(model);
    const double least = size * median(sizes);
    for (std::size_t i = 0; i < set.size(); ++i)
        set[i] = sizes[i] >= least && sigmoid(double{model.opacity_logit[i]}) <= opacity ? 1 : 0;
    return set;
}

}  // namespace darb
