// SPDX-License-Identifier: MIT
// Merges in rounds until few enough splats are left. A splat may merge with its nearest neighbours;
// pairs are taken from the cheapest on, each splat at most once, up to a share of all in a round,
// so that early merges are cheap. Each thread works on its own splats, and ties are broken by
// index, so that the number of threads does not matter.
#include "engine/scene/merge_splats.h"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>

#include <limits>
#include <numbers>
#include <numeric>
#include <thread>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/on_threads.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/point_tree.h"
#include "engine/scene/quantise.h"
#include "engine/scene/sh_basis.h"
#include "engine/scene/splat_model.h"

namespace darb {

namespace {

constexpr std::size_t kNearest = 6;
constexpr std::size_t kRoundDivisor = 4;  // a round merges at most a fourth of the splats
constexpr std::size_t kAlongCurve = 2;    // quick: this many later splats on the curve are
                                          // neighbours
constexpr std::size_t kCurveSplats = 64;  // splats with one code of the curve
constexpr double kApart = 1e-3;
constexpr std::size_t kBlock = 1 << 15, kPart = 256;  // splats between reports; splats that a
                                                      // thread takes at a time
constexpr std::uint32_t kNone = 0xffffffff;

/// Means, each moved by up to a thousandth of its splat's size: many means in one place would make
/// every search visit all of them.
std::vector<glm::dvec3> apart(const std::vector<SplatMoments>& moments) {
    std::vector<glm::dvec3> points(moments.size());
    std::uint32_t state = 1;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Symmetric3& c = moments[i].covariance;
        const double size = kApart * std::sqrt(c[0] + c[3] + c[5]);
        for (int k = 0; k < 3; ++k) {
            state = 1664525u * state + 1013904223u;  // Numerical Recipes
            points[i][k] = moments[i].mean[k] + size * (state / 0x1p31 - 1);
        }
    }
    return points;
}

struct Candidate {
    double error;
    std::uint32_t a, b;  // a < b
    auto operator<=>(const Candidate&) const = default;
};

/// The splats of the level that is being made.
class Merging {
  public:
    Merging(const SplatModel& model, std::size_t last, const MergeOptions& options);
    void merge_to(std::size_t count);
    /// The model of the splats as they are now.
    SplatModel level() const;

  private:
    void drop_undrawn(std::size_t count);
    std::vector<std::uint32_t> find_neighbours();
    std::vector<Candidate> find_candidates(const std::vector<std::uint32_t>& neighbours);
    std::size_t merge_cheapest(std::vector<Candidate>& candidates, std::size_t most);
    void merge(std::uint32_t a, std::uint32_t b);
    template <class Keep>
    void keep_only(const Keep& keep);
    template <class Work>
    void for_all(double from, double to, const Work& work);
    void report(double share_of_round) const;

    SplatModel model_;  // current harmonics; everything else of splats that were not merged
    std::vector<SplatMoments> moments_;
    std::vector<std::uint8_t> merged_;
    double second_moment_;
    std::size_t threads_, first_, last_, round_ = 0;  // splats; merges in the current round
    const MergeOptions& options_;
};

bool is_drawn(const SplatModel& model, std::size_t i) {
    return is_finite(model, i) && has_rotation(model, i);
}

/// Splats that are not drawn count as being at the origin.
SplatModel along_curve(const SplatModel& model) {
    SplatModel places;
    places.origin = model.origin;
    places.position = model.position;
    places.opacity_logit = model.opacity_logit;  // sets the number of splats
    for (std::size_t i = 0; i < model.size(); ++i)
        if (!is_drawn(model, i)) std::fill_n(&places.position[3 * i], 3, 0.0f);
    return pick_splats(model, chunk_order(places, kCurveSplats));
}

Merging::Merging(const SplatModel& model, std::size_t last, const MergeOptions& options)
    : model_(options.quick ? along_curve(model) : model),
      second_moment_(rendered_second_moment(model.kernel, model.footprint)),
      threads_(options.threads > 0 ? options.threads
                                   : std::max(1u, std::thread::hardware_concurrency())),
      first_(model.size()),
      last_(last),
      options_(options) {
    merged_.resize(first_);
    moments_.resize(first_);
    for (std::size_t i = 0; i < first_; ++i)
        if (is_drawn(model_, i)) moments_[i] = moments_of(model_, i);
    if (!kernel_has_shape(model.kernel)) return;
    const ShapedKernel& kernel = shaped_kernel(model.kernel);
    // A merged splat has the shape 0, so a splat counts as the one with this shape that is as wide.
    for (std::size_t i = 0; i < first_; ++i) {
        const double moment = kernel.second_moment(
            model.footprint, kernel.exponent(model.footprint, model_.shape[i]));
        for (double& c : moments_[i].covariance) c *= moment / second_moment_;
        moments_[i].mass *= moment / second_moment_;
    }
}

void Merging::report(double share) const {
    if (!options_.progress || first_ <= last_) return;
    const double done =
        static_cast<double>(first_ - model_.size()) + share * static_cast<double>(round_);
    options_.progress(std::min(done / static_cast<double>(first_ - last_), 1.0));
}

/// Calls work(i) for all splats, on all threads; work must not throw.
template <class Work>
void Merging::for_all(double from, double to, const Work& work) {
    const std::size_t count = model_.size();
    for (std::size_t begin = 0; begin < count; begin += kBlock) {
        report(from + (to - from) * static_cast<double>(begin) / static_cast<double>(count));
        const std::size_t end = std::min(begin + kBlock, count);
        std::atomic<std::size_t> next{begin};
        on_threads(threads_, [&] {
            for (std::size_t i; (i = next.fetch_add(kPart)) < end;)
                for (std::size_t k = i; k < std::min(i + kPart, end); ++k) work(k);
        });
    }
}

template <class Keep>
void Merging::keep_only(const Keep& keep) {
    std::size_t to = 0;
    const std::size_t count = model_.size();
    for (std::size_t i = 0; i < count; ++i) {
        if (!keep(i)) continue;
        if (to != i) {
            for (int a = 0; a < kAttributeCount; ++a) {
                std::vector<float>& values = attribute_values(model_, a);
                const auto floats = static_cast<std::ptrdiff_t>(model_.floats(a));
                const auto begin = values.begin();
                std::copy_n(begin + static_cast<std::ptrdiff_t>(i) * floats, floats,
                            begin + static_cast<std::ptrdiff_t>(to) * floats);
            }
            moments_[to] = moments_[i];
            merged_[to] = merged_[i];
        }
        ++to;
    }
    moments_.resize(to);
    merged_.resize(to);
    model_.resize(to);
}

/// Drops splats that are never drawn, but no more than it takes to come down to `count`.
void Merging::drop_undrawn(std::size_t count) {
    std::size_t excess = model_.size() - std::min(count, model_.size());
    if (excess == 0) return;
    keep_only([&](std::size_t i) {
        if (excess == 0 || is_drawn(model_, i)) return true;
        --excess;
        return false;
    });
}

std::vector<std::uint32_t> Merging::find_neighbours() {
    if (options_.quick) {
        std::vector<std::uint32_t> next(kNearest * model_.size(), kNone);
        for (std::size_t i = 0; i < model_.size(); ++i)
            for (std::size_t k = 0; k < kAlongCurve && i + k + 1 < model_.size(); ++k)
                next[kNearest * i + k] = static_cast<std::uint32_t>(i + k + 1);
        return next;
    }
    const std::vector<glm::dvec3> points = apart(moments_);
    const PointsView view{points};
    PointTree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(16));
    tree.buildIndex();
    std::vector<std::uint32_t> neighbours(kNearest * model_.size(), kNone);
    for_all(0, 0.5, [&](std::size_t i) {
        std::uint32_t index[kNearest + 1];
        double distance2[kNearest + 1];
        // The splat itself is among them.
        const std::size_t found = tree.knnSearch(&points[i][0], kNearest + 1, index, distance2);
        std::size_t to = kNearest * i;
        for (std::size_t k = 0; k < found && to < kNearest * (i + 1); ++k)
            if (index[k] != i) neighbours[to++] = index[k];
    });
    return neighbours;
}

std::vector<Candidate> Merging::find_candidates(const std::vector<std::uint32_t>& neighbours) {
    std::vector<Candidate> candidates(neighbours.size(), {0, kNone, kNone});
    for_all(0.5, 0.95, [&](std::size_t i) {
        for (std::size_t k = kNearest * i; k < kNearest * (i + 1); ++k) {
            const std::uint32_t other = neighbours[k];
            if (other == kNone) break;
            // Where both list the pair, it belongs to the smaller index.
            const auto his = neighbours.begin() + static_cast<std::ptrdiff_t>(kNearest * other);
            const auto end = his + static_cast<std::ptrdiff_t>(kNearest);
            if (other < i && std::find(his, end, static_cast<std::uint32_t>(i)) != end) continue;
            const std::uint32_t a = std::min(static_cast<std::uint32_t>(i), other);
            const std::uint32_t b = std::max(static_cast<std::uint32_t>(i), other);
            const SplatMoments both = merge_moments(moments_[a], moments_[b], second_moment_);
            candidates[k] = {merge_error(moments_[a], moments_[b], both, second_moment_), a, b};
        }
    });
    std::erase_if(candidates, [](const Candidate& c) { return c.a == kNone; });
    std::sort(candidates.begin(), candidates.end());
    return candidates;
}

void Merging::merge(std::uint32_t a, std::uint32_t b) {
    double share = 0;
    moments_[a] = merge_moments(moments_[a], moments_[b], second_moment_, &share);
    merged_[a] = 1;
    if (!model_.shape.empty()) model_.shape[a] = 0;
    for (const int attribute : {int{kShDc}, int{kShRest}}) {
        std::vector<float>& values = attribute_values(model_, attribute);
        const std::size_t floats = model_.floats(attribute);
        for (std::size_t c = 0; c < floats; ++c) {
            const double from = values[floats * a + c], to = values[floats * b + c];
            values[floats * a + c] = static_cast<float>(from + share * (to - from));
        }
    }
}

std::size_t Merging::merge_cheapest(std::vector<Candidate>& candidates, std::size_t most) {
    std::vector<std::uint8_t> taken(model_.size());  // 1: has absorbed another; 2: absorbed
    std::size_t merges = 0;
    for (const Candidate& c : candidates) {
        if (merges == most) break;
        if (taken[c.a] || taken[c.b]) continue;
        merge(c.a, c.b);
        taken[c.a] = 1;
        taken[c.b] = 2;
        ++merges;
    }
    candidates = {};
    keep_only([&](std::size_t i) { return taken[i] != 2; });
    return merges;
}

void Merging::merge_to(std::size_t count) {
    drop_undrawn(count);
    while (model_.size() > count) {
        round_ = std::min(model_.size() - count, model_.size() / kRoundDivisor + 1);
        std::vector<Candidate> candidates = find_candidates(find_neighbours());
        merge_cheapest(candidates, round_);
        round_ = 0;
    }
    report(0);
}

SplatModel Merging::level() const {
    SplatModel level = model_;
    for (std::size_t i = 0; i < level.size(); ++i)
        if (merged_[i]) set_moments(moments_[i], i, level);
    return level;
}

}  // namespace

std::vector<SplatModel> merge_levels(const SplatModel& model,
                                     const std::vector<std::size_t>& counts,
                                     const MergeOptions& options) {
    check_splat_shapes(model);
    std::vector<SplatModel> levels;
    if (counts.empty()) return levels;
    for (std::size_t i = 0; i < counts.size(); ++i)
        if (counts[i] == 0 || (i > 0 && counts[i] > counts[i - 1]))
            throw Error("merge_levels",
                        fmt::format("cannot merge to the count {} of level {}", counts[i], i),
                        "Give counts that fall and end above 0.");
    Merging merging(model, counts.back(), options);
    for (const std::size_t count : counts) {
        if (count >= model.size()) {
            levels.push_back(model);
            continue;
        }
        merging.merge_to(count);
        levels.push_back(merging.level());
    }
    return levels;
}

SplatModel merge_splats(const SplatModel& model, std::size_t count, const MergeOptions& options) {
    return std::move(merge_levels(model, {count}, options).front());
}

namespace {

constexpr double kThinnest = 1e-3;  // least variance of a projection, as a share of the mean
                                    // variance

constexpr double kLeastOpacity = 1e-13;  // the limit of logits
constexpr double kMostOpacity = 0.99;    // where blending clamps
// Opaque neighbours hide each other, so of an opacity above 1 only this power becomes area.
// Measured, see docs/experiments/merging.md.
constexpr double kGrowth = 0.4;

/// Symmetric 2x2: xx, xy, yy.
struct Covariance2 {
    double xx, xy, yy;
    double determinant() const { return std::max(xx * yy - xy * xy, 0.0); }
};

Covariance2 projection(const Symmetric3& c, int axis) {
    const double least = kThinnest * (c[0] + c[3] + c[5]) / 3;
    switch (axis) {
        case 0:
            return {c[3] + least, c[4], c[5] + least};
        case 1:
            return {c[0] + least, c[2], c[5] + least};
        default:
            return {c[0] + least, c[1], c[3] + least};
    }
}

/// A splat as seen in a picture along an axis.
struct Blob {
    Covariance2 covariance;
    double root;  // square root of the determinant
    double x, y, opacity;
};

/// Integral of the product of two Gaussians with peak 1, divided by 2 pi.
double overlap(const Blob& a, const Blob& b, double second_moment) {
    const Covariance2 sum{a.covariance.xx + b.covariance.xx, a.covariance.xy + b.covariance.xy,
                          a.covariance.yy + b.covariance.yy};
    const double determinant = sum.determinant();
    if (!(determinant > 0)) return 0;
    const double dx = a.x - b.x, dy = a.y - b.y;
    const double q = (sum.yy * dx * dx - 2 * sum.xy * dx * dy + sum.xx * dy * dy) / determinant;
    return a.root * b.root / std::sqrt(determinant) * std::exp(-0.5 * q / second_moment);
}

}  // namespace

double mean_area(const Symmetric3& c) {
    const double minors = std::max(c[0] * c[3] - c[1] * c[1], 0.0) +
                          std::max(c[3] * c[5] - c[4] * c[4], 0.0) +
                          std::max(c[0] * c[5] - c[2] * c[2], 0.0);
    return std::sqrt(minors / 3);
}

SplatMoments moments_of(const SplatModel& model, std::size_t i) {
    SplatMoments m;
    const float* p = &model.position[3 * i];
    const float* r = &model.rotation[4 * i];
    m.mean = {p[0], p[1], p[2]};
    const glm::dmat3 turn = glm::mat3_cast(glm::normalize(glm::dquat(r[0], r[1], r[2], r[3])));
    glm::dmat3 axes = turn;
    for (int k = 0; k < 3; ++k)
        axes[k] *= std::exp(std::clamp(double{model.log_scale[3 * i + static_cast<std::size_t>(k)]},
                                       -LOG_SCALE_LIMIT, LOG_SCALE_LIMIT));
    const glm::dmat3 c = axes * glm::transpose(axes);
    m.covariance = {c[0][0], c[1][0], c[2][0], c[1][1], c[2][1], c[2][2]};
    m.mass = sigmoid(model.opacity_logit[i]) * mean_area(m.covariance);
    for (int k = 0; k < 3; ++k)
        m.colour[k] =
            std::clamp(0.5 + SH_C0 * model.sh_dc[3 * i + static_cast<std::size_t>(k)], 0.0, 1.0);
    return m;
}

SplatMoments merge_moments(const SplatMoments& a, const SplatMoments& b, double second_moment,
                           double* share_of_b) {
    SplatMoments m;
    m.mass = a.mass + b.mass;
    const double w = m.mass > 0 ? b.mass / m.mass : 0.5;
    if (share_of_b) *share_of_b = w;
    const glm::dvec3 d = b.mean - a.mean;
    m.mean = a.mean + w * d;
    m.colour = a.colour + w * (b.colour - a.colour);
    const double spread = w * (1 - w) / second_moment;
    const double outer[] = {d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z};
    for (std::size_t k = 0; k < 6; ++k)
        m.covariance[k] = (1 - w) * a.covariance[k] + w * b.covariance[k] + spread * outer[k];
    return m;
}

double merge_error(const SplatMoments& a, const SplatMoments& b, const SplatMoments& merged,
                   double second_moment) {
    const SplatMoments* const splats[] = {&a, &b, &merged};
    double colours[3][3];
    for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j)
            colours[i][j] = 1 + glm::dot(splats[i]->colour, splats[j]->colour);
    double opacity[3];
    for (int i = 0; i < 3; ++i) {
        const double area = mean_area(splats[i]->covariance);
        const double o = area > 0 ? splats[i]->mass / area : 0;
        opacity[i] = i == 2 ? -o : o;
    }
    double error = 0;
    for (int axis = 0; axis < 3; ++axis) {
        Blob blobs[3];
        const int x = axis == 0 ? 1 : 0, y = axis == 2 ? 1 : 2;
        for (int i = 0; i < 3; ++i) {
            const SplatMoments& s = *splats[i];
            const Covariance2 c = projection(s.covariance, axis);
            blobs[i] = {c, std::sqrt(c.determinant()), s.mean[x], s.mean[y], opacity[i]};
        }
        for (int i = 0; i < 3; ++i) {
            error += colours[i][i] * opacity[i] * opacity[i] * blobs[i].root / 2;
            for (int j = i + 1; j < 3; ++j)
                error += 2 * colours[i][j] * opacity[i] * opacity[j] *
                         overlap(blobs[i], blobs[j], second_moment);
        }
    }
    return std::isfinite(error) ? std::max(error, 0.0) : std::numeric_limits<double>::max();
}

void set_moments(const SplatMoments& m, std::size_t i, SplatModel& model) {
    const Symmetric3& c = m.covariance;
    Eigen::Matrix3d matrix;
    matrix << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
    const Eigen::Vector3d& variance = solver.eigenvalues();
    const Eigen::Matrix3d& axes = solver.eigenvectors();
    glm::dmat3 turn;
    for (int k = 0; k < 3; ++k) turn[k] = {axes(0, k), axes(1, k), axes(2, k)};
    if (glm::determinant(turn) < 0) turn[2] = -turn[2];
    const glm::dquat q = glm::normalize(glm::quat_cast(turn));
    const double area = mean_area(c), opacity = area > 0 ? m.mass / area : 0;
    const double shown = std::clamp(opacity, kLeastOpacity, kMostOpacity);
    const double growth = opacity > shown ? kGrowth / 2 * std::log(opacity / shown) : 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double least = std::exp(-2 * LOG_SCALE_LIMIT);
        model.position[3 * i + k] = static_cast<float>(m.mean[static_cast<int>(k)]);
        model.log_scale[3 * i + k] = static_cast<float>(
            std::log(std::max(variance[static_cast<Eigen::Index>(k)], least)) / 2 + growth);
    }
    const double wxyz[] = {q.w, q.x, q.y, q.z};
    for (std::size_t k = 0; k < 4; ++k) model.rotation[4 * i + k] = static_cast<float>(wxyz[k]);
    model.opacity_logit[i] = static_cast<float>(std::log(shown / (1 - shown)));
}

}  // namespace darb
