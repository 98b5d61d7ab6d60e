// SPDX-License-Identifier: MIT
#include "engine/data/track_adjustment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "engine/core/quantile.h"
#include "engine/data/lens_model.h"
#include "engine/scene/pose_metric.h"

namespace darb {

namespace {

constexpr int kMostSteps = 50, kMostGradients = 60;
constexpr std::size_t kFewestObservations = 10;  // a view with fewer does not move
constexpr double kLeastGain = 0.5;  // the median error must fall to this share of itself
constexpr double kEnough = 1e-5;    // stop where a step lowers the cost by less than this share

using Six = std::array<PoseVector, 6>;

Six inverse_of(const Six& a) {  // symmetric, positive definite; by Gauss-Jordan elimination
    Six m = a, inverse{};
    for (std::size_t i = 0; i < 6; ++i) inverse[i][i] = 1;
    for (std::size_t i = 0; i < 6; ++i) {
        const double pivot = 1 / m[i][i];
        for (std::size_t j = 0; j < 6; ++j) m[i][j] *= pivot, inverse[i][j] *= pivot;
        for (std::size_t r = 0; r < 6; ++r) {
            if (r == i) continue;
            const double share = m[r][i];
            for (std::size_t j = 0; j < 6; ++j)
                m[r][j] -= share * m[i][j], inverse[r][j] -= share * inverse[i][j];
        }
    }
    return inverse;
}

PoseVector times(const Six& a, const PoseVector& x) {
    PoseVector y{};
    for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t j = 0; j < 6; ++j) y[i] += a[i][j] * x[j];
    return y;
}

double dot(const std::vector<PoseVector>& a, const std::vector<PoseVector>& b) {
    double sum = 0;
    for (std::size_t v = 0; v < a.size(); ++v)
        for (std::size_t i = 0; i < 6; ++i) sum += a[v][i] * b[v][i];
    return sum;
}

struct Cross {  // J_camera^T J_point for one observation
    std::array<glm::dvec3, 6> rows{};
};

// The normal equations of one step.
struct Normal {
    std::vector<Six> cameras;           // [view], damped
    std::vector<PoseVector> d_cameras;  // [view] -J^T r
    std::vector<glm::dmat3> points;     // [point] inverse, damped
    std::vector<glm::dvec3> d_points;   // [point] -J^T r
    std::vector<Cross> cross;           // [observation]
};

class Adjustment {
  public:
    explicit Adjustment(const Dataset& dataset) : all_(track_observations(dataset)) {
        for (const View& view : dataset.views) cameras_.push_back(view.camera);
        for (std::size_t p = 0; p < dataset.points.size(); ++p) {
            const double* x = &dataset.points.position[3 * p];
            points_.emplace_back(x[0], x[1], x[2]);
        }
        std::vector<std::size_t> seen(cameras_.size(), 0);
        for (const TrackObservation& o : all_) ++seen[o.view];
        for (const std::size_t count : seen) moves_.push_back(count >= kFewestObservations);
        tracked_.resize(points_.size(), false);
        for (const TrackObservation& o : all_) tracked_[o.point] = true;
    }

    const std::vector<TrackObservation>& observations() const { return all_; }
    std::size_t moving() const {
        return static_cast<std::size_t>(std::count(moves_.begin(), moves_.end(), true));
    }
    std::size_t tracked() const {
        return static_cast<std::size_t>(std::count(tracked_.begin(), tracked_.end(), true));
    }
    bool moves(std::size_t view) const { return moves_[view]; }
    const std::vector<Camera>& cameras() const { return cameras_; }
    const std::vector<glm::dvec3>& points() const { return points_; }

    void solve() {
        double damping = 1e-4;
        for (int step = 0; step < kMostSteps; ++step) {
            limit_px_ = std::max(median_error(), 1e-3);
            const double before = cost(cameras_, points_);
            bool better = false;
            for (int trial = 0; trial < 8 && !better; ++trial) {
                const Normal normal = equations(damping);
                const std::vector<PoseVector> d = camera_step(normal);
                std::vector<Camera> cameras = cameras_;
                for (std::size_t v = 0; v < d.size(); ++v)
                    if (moves_[v]) cameras[v] = moved_camera(cameras_[v], d[v]);
                std::vector<glm::dvec3> points = points_;
                add_point_steps(normal, d, points);
                const double after = cost(cameras, points);
                better = after < before;
                damping = std::clamp(better ? damping / 5 : damping * 10, 1e-9, 1e3);
                if (!better) continue;
                cameras_ = std::move(cameras);
                points_ = std::move(points);
                if (before - after < kEnough * before) return;
            }
            if (!better) return;
        }
    }

  private:
    double median_error() const {
        std::vector<double> errors;
        for (const TrackObservation& o : all_) {
            const double e =
                glm::distance(pinhole_pixel(cameras_[o.view], points_[o.point]), o.at_px);
            if (std::isfinite(e)) errors.push_back(e);
        }
        return errors.empty() ? 1 : nearest_rank(errors, 0.5);
    }

    // A point behind a camera costs what an error of 1,000 limits would.
    double cost(const std::vector<Camera>& cameras, const std::vector<glm::dvec3>& points) const {
        double sum = 0;
        for (const TrackObservation& o : all_) {
            double e = glm::distance(pinhole_pixel(cameras[o.view], points[o.point]), o.at_px);
            if (!std::isfinite(e)) e = 1e3 * limit_px_;
            sum += e <= limit_px_ ? e * e / 2 : limit_px_ * (e - limit_px_ / 2);
        }
        return sum;
    }

    Normal equations(double damping) const {
        Normal n;
        n.cameras.resize(cameras_.size());
        n.d_cameras.resize(cameras_.size());
        n.points.assign(points_.size(), glm::dmat3(0.0));
        n.d_points.assign(points_.size(), glm::dvec3(0.0));
        n.cross.resize(all_.size());
        for (std::size_t k = 0; k < all_.size(); ++k) add_observation(k, n);
        for (Six& block : n.cameras)
            for (std::size_t i = 0; i < 6; ++i) block[i][i] += damping * block[i][i] + 1e-12;
        for (glm::dmat3& block : n.points) {
            for (int i = 0; i < 3; ++i) block[i][i] += damping * block[i][i] + 1e-12;
            block = glm::inverse(block);
        }
        return n;
    }

    void add_observation(std::size_t k, Normal& n) const {
        const TrackObservation& o = all_[k];
        const Camera& c = cameras_[o.view];
        const glm::dvec3 p = c.rotation * points_[o.point] + c.translation;
        if (!(p.z > 0)) return;
        const glm::dvec2 error = pinhole_pixel(c, points_[o.point]) - o.at_px;
        const double weight = std::min(1.0, limit_px_ / std::max(glm::length(error), 1e-12));
        const std::array<PoseVector, 2> by_pose = pixel_by_pose(c, p);
        for (std::size_t r = 0; r < 2; ++r) {
            const PoseVector& row = by_pose[r];
            const glm::dvec3 by_point = glm::dvec3(row[3], row[4], row[5]) * c.rotation;
            const double e = weight * error[static_cast<int>(r)];
            n.points[o.point] += weight * glm::outerProduct(by_point, by_point);
            n.d_points[o.point] -= e * by_point;
            if (!moves_[o.view]) continue;
            for (std::size_t i = 0; i < 6; ++i) {
                for (std::size_t j = 0; j < 6; ++j)
                    n.cameras[o.view][i][j] += weight * row[i] * row[j];
                n.d_cameras[o.view][i] -= e * row[i];
                n.cross[k].rows[i] += weight * row[i] * by_point;
            }
        }
    }

    // (U - W V^-1 W^T) x without forming the matrix; with x = 0 and d_points, -W V^-1 d_points.
    std::vector<PoseVector> through_points(const Normal& n, const std::vector<PoseVector>& x,
                                           bool of_points) const {
        std::vector<PoseVector> y(x.size());
        if (!of_points)
            for (std::size_t v = 0; v < x.size(); ++v) y[v] = times(n.cameras[v], x[v]);
        for (std::size_t begin = 0, end = 0; begin < all_.size(); begin = end) {
            const std::uint32_t point = all_[begin].point;
            glm::dvec3 sum(0.0);
            for (end = begin; end < all_.size() && all_[end].point == point; ++end)
                if (!of_points)
                    for (std::size_t i = 0; i < 6; ++i)
                        sum += n.cross[end].rows[i] * x[all_[end].view][i];
            const glm::dvec3 solved = n.points[point] * (of_points ? n.d_points[point] : sum);
            for (std::size_t k = begin; k < end; ++k)
                for (std::size_t i = 0; i < 6; ++i)
                    y[all_[k].view][i] -= glm::dot(n.cross[k].rows[i], solved);
        }
        return y;
    }

    std::vector<PoseVector> camera_step(const Normal& n) const {
        std::vector<Six> inverse;
        for (const Six& block : n.cameras) inverse.push_back(inverse_of(block));
        std::vector<PoseVector> x(n.cameras.size());
        std::vector<PoseVector> rest = through_points(n, x, true);
        for (std::size_t v = 0; v < rest.size(); ++v)
            for (std::size_t i = 0; i < 6; ++i) rest[v][i] += n.d_cameras[v][i];
        const auto precondition = [&] {
            std::vector<PoseVector> z;
            for (std::size_t v = 0; v < rest.size(); ++v)
                z.push_back(moves_[v] ? times(inverse[v], rest[v]) : PoseVector{});
            return z;
        };
        std::vector<PoseVector> z = precondition(), direction = z;
        double size = dot(rest, z);
        const double enough = 1e-8 * size;
        for (int i = 0; i < kMostGradients && size > enough; ++i) {
            const std::vector<PoseVector> image = through_points(n, direction, false);
            const double along = size / dot(direction, image);
            if (!std::isfinite(along)) break;
            for (std::size_t v = 0; v < x.size(); ++v)
                for (std::size_t k = 0; k < 6; ++k) {
                    x[v][k] += along * direction[v][k];
                    rest[v][k] -= along * image[v][k];
                }
            z = precondition();
            const double next = dot(rest, z);
            for (std::size_t v = 0; v < x.size(); ++v)
                for (std::size_t k = 0; k < 6; ++k)
                    direction[v][k] = z[v][k] + next / size * direction[v][k];
            size = next;
        }
        return x;
    }

    void add_point_steps(const Normal& n, const std::vector<PoseVector>& x,
                         std::vector<glm::dvec3>& points) const {
        for (std::size_t begin = 0, end = 0; begin < all_.size(); begin = end) {
            const std::uint32_t point = all_[begin].point;
            glm::dvec3 sum = n.d_points[point];
            for (end = begin; end < all_.size() && all_[end].point == point; ++end)
                for (std::size_t i = 0; i < 6; ++i)
                    sum -= n.cross[end].rows[i] * x[all_[end].view][i];
            points[point] += n.points[point] * sum;
        }
    }

    std::vector<TrackObservation> all_;
    std::vector<Camera> cameras_;
    std::vector<glm::dvec3> points_;
    std::vector<bool> moves_, tracked_;
    double limit_px_ = 1;  // where Huber's loss becomes linear
};

}  // namespace

TrackAdjustment adjust_to_tracks(Dataset& dataset) {
    TrackAdjustment result;
    Adjustment adjustment(dataset);
    result.views = adjustment.moving();
    result.points = adjustment.tracked();
    result.observations = adjustment.observations().size();
    if (result.views < 2) return result;
    result.before_px = result.after_px = median_track_error_px(dataset, adjustment.observations());
    adjustment.solve();
    Dataset adjusted;
    adjusted.views = dataset.views;
    adjusted.points = dataset.points;
    for (std::size_t v = 0; v < adjusted.views.size(); ++v)
        adjusted.views[v].camera = adjustment.cameras()[v];
    for (std::size_t p = 0; p < adjustment.points().size(); ++p)
        for (std::size_t c = 0; c < 3; ++c)
            adjusted.points.position[3 * p + c] = adjustment.points()[p][static_cast<int>(c)];
    const double after = median_track_error_px(adjusted, adjustment.observations());
    if (!(after < (1 - kLeastGain) * result.before_px)) return result;
    std::vector<double> moves;
    for (std::size_t v = 0; v < dataset.views.size(); ++v) {
        if (!adjustment.moves(v)) continue;
        std::vector<double> shifts;
        for (const TrackObservation& o : adjustment.observations())
            if (o.view == v)
                shifts.push_back(glm::distance(
                    pinhole_pixel(dataset.views[v].camera, adjustment.points()[o.point]),
                    pinhole_pixel(adjusted.views[v].camera, adjustment.points()[o.point])));
        moves.push_back(nearest_rank(shifts, 0.5));
    }
    result.adjusted = true;
    result.after_px = after;
    result.median_move_px = nearest_rank(moves, 0.5);
    dataset.views = std::move(adjusted.views);
    dataset.points = std::move(adjusted.points);
    return result;
}

namespace {

// Caches lenses by their model and parameters, because photos share them.
class Lenses {
  public:
    const Lens& of(const LensModel& model) {
        const auto [at, is_new] =
            made_.try_emplace({model.model, model.parameters, model.width, model.height});
        if (is_new) at->second.emplace(model);
        return *at->second;
    }

  private:
    std::map<std::tuple<std::string, std::vector<double>, int, int>, std::optional<Lens>> made_;
};

}  // namespace

std::vector<TrackObservation> track_observations(const Dataset& dataset, std::size_t fewest,
                                                 std::size_t most) {
    std::vector<TrackObservation> all;
    const PointCloud& points = dataset.points;
    if (!points.has_tracks()) return all;
    const std::size_t step = points.seen_by.size() / most + 1;
    Lenses lenses;
    for (std::size_t p = 0; p + 1 < points.seen_begin.size(); p += step) {
        const std::size_t before = all.size();
        for (std::size_t k = points.seen_begin[p]; k < points.seen_begin[p + 1]; ++k) {
            const View& view = dataset.views[points.seen_by[k]];
            const glm::dvec2 at(double(points.seen_at[2 * k]) * view.lens.width,
                                double(points.seen_at[2 * k + 1]) * view.lens.height);
            if (!std::isfinite(at.x + at.y)) continue;
            const auto ray = lenses.of(view.lens).unproject(at);
            if (!ray) continue;
            const Camera& c = view.camera;
            all.push_back({points.seen_by[k],
                           static_cast<std::uint32_t>(p),
                           {c.fx * ray->x + c.cx, c.fy * ray->y + c.cy}});
        }
        if (all.size() - before < fewest) all.resize(before);
    }
    return all;
}

glm::dvec2 pinhole_pixel(const Camera& camera, const glm::dvec3& world) {
    const glm::dvec3 p = camera.rotation * world + camera.translation;
    if (!(p.z > 0)) return glm::dvec2(std::numeric_limits<double>::quiet_NaN());
    return {camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy};
}

double median_track_error_px(const Dataset& dataset,
                             const std::vector<TrackObservation>& observations) {
    std::vector<double> errors;
    for (const TrackObservation& o : observations) {
        const double* x = &dataset.points.position[3 * std::size_t{o.point}];
        const glm::dvec2 at =
            pinhole_pixel(dataset.views[o.view].camera, glm::dvec3(x[0], x[1], x[2]));
        const double error = glm::distance(at, o.at_px);
        if (std::isfinite(error)) errors.push_back(error);
    }
    return errors.empty() ? 0 : nearest_rank(errors, 0.5);
}

}  // namespace darb
