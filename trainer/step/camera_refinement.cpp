// SPDX-License-Identifier: MIT
#include "trainer/step/camera_refinement.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "engine/data/metrics.h"

namespace darb {

namespace {

constexpr double kBeta1 = 0.9, kBeta2 = 0.99;  // a camera is visited some dozen times
constexpr double kLastShare = 0.02;            // share of the rate at the end of the run
// As a share of the poses' rate, over a round of the photos: each visit moves all their pictures.
constexpr double kIntrinsicsShare = 0.5;
// px a visit, where tracks anchor a pose and where pictures alone are to find it.
constexpr double kAnchoredRate_px = 0.1, kFreeRate_px = 0.5;
constexpr std::size_t kMostTracks = 1'000;  // most tracks that anchor one photo
constexpr double kHuberPx = 1;              // beyond this error tracks pull no harder
// A picture's rows deviate from the middle by 1 / sqrt(12) of its height (the root of the mean
// square): so much less than a pose does a change over the read-out shift the picture.
const double kRowSpread = std::sqrt(12.0);
constexpr std::size_t kFewestCameras = 3;
constexpr std::size_t kPointsOfAll = 20'000;  // points that size a step where there are no tracks

std::vector<glm::dvec3> positions(const PointCloud& points) {
    std::vector<glm::dvec3> all;
    for (std::size_t p = 0; p < points.size(); ++p)
        all.emplace_back(points.position[3 * p], points.position[3 * p + 1],
                         points.position[3 * p + 2]);
    return all;
}

// For each view the points that its photo saw; without tracks, the same sample of all for each.
std::vector<std::vector<glm::dvec3>> points_by_view(const Dataset& dataset,
                                                    const std::vector<glm::dvec3>& points) {
    const PointCloud& cloud = dataset.points;
    if (cloud.seen_begin.empty()) {
        std::vector<glm::dvec3> some;
        for (std::size_t p = 0; p < points.size(); p += points.size() / kPointsOfAll + 1)
            some.push_back(points[p]);
        return {some};
    }
    std::vector<std::vector<glm::dvec3>> by_view(dataset.views.size());
    for (std::size_t p = 0; p + 1 < cloud.seen_begin.size(); ++p)
        for (std::size_t k = cloud.seen_begin[p]; k < cloud.seen_begin[p + 1]; ++k)
            by_view[cloud.seen_by[k]].push_back(points[p]);
    return by_view;
}

std::vector<Camera> of_poses(const Dataset& dataset) {
    std::vector<Camera> cameras;
    for (const View& view : dataset.views)
        if (!view.is_test) cameras.push_back(view.camera);
    if (cameras.size() < kFewestCameras)
        throw Error(
            "refined cameras",
            fmt::format("{} photos are trained on, {} are needed", cameras.size(), kFewestCameras),
            "Leave --refine-cameras out, or add photos.");
    return cameras;
}

}  // namespace

// Adam with bias correction (Kingma and Ba 2015), rounded to what a checkpoint holds.
template <std::size_t N>
void CameraRefinement::Trained<N>::step(const std::array<double, N>& gradient, double rate) {
    visits += 1;
    const double correction1 = 1 - std::pow(kBeta1, visits);
    const double correction2 = 1 - std::pow(kBeta2, visits);
    for (std::size_t i = 0; i < N; ++i) {
        const double m = kBeta1 * first[i] + (1 - kBeta1) * gradient[i];
        const double v = kBeta2 * second[i] + (1 - kBeta2) * gradient[i] * gradient[i];
        first[i] = static_cast<float>(m);
        second[i] = static_cast<float>(v);
        const double size = std::sqrt(v / correction2);
        if (size > 0) value[i] -= static_cast<float>(rate * m / correction1 / size);
    }
}

CameraRefinement::CameraRefinement(const Dataset& dataset, const TrainOptions& options)
    : rate_px_(options.camera_lr.value_or(0)),
      anchor_(options.camera_anchor),
      from_(options.camera_from),
      iterations_(options.iterations),
      shutters_(options.projection.shutter),
      tries_shutters_(options.probe_shutter),
      points_(positions(dataset.points)),
      pose_of_(dataset.views.size(), -1),
      gauge_({}, {}) {
    const std::vector<Camera> starts = of_poses(dataset);
    const auto seen = points_by_view(dataset, points_);
    const double depth = scene_extent(dataset);
    std::map<std::tuple<int, int, double, double, double, double>, std::size_t> groups;
    for (std::size_t v = 0; v < dataset.views.size(); ++v) {
        const View& view = dataset.views[v];
        const Camera& c = view.camera;
        start_.push_back(c);
        const auto [at, is_new] = groups.try_emplace(
            std::tuple{c.width, c.height, c.fx, c.fy, c.cx, c.cy}, groups_.size());
        if (is_new) {
            groups_.emplace_back();
            // The root of the mean square of the distance from the centre is side / sqrt(12).
            groups_.back().unit = {c.fx / (c.width / std::sqrt(12.0)),
                                   c.fy / (c.height / std::sqrt(12.0)), 1, 1};
        }
        group_of_.push_back(static_cast<int>(at->second));
        if (view.is_test) continue;
        groups_[at->second].trained_views += 1;
        pose_of_[v] = static_cast<int>(poses_.size());
        poses_.push_back(
            {static_cast<int>(v), PoseMetric(c, seen[seen.size() > 1 ? v : 0], depth), {}, {}, {}});
    }
    cameras_ = start_;
    for (const TrackObservation& o : track_observations(dataset))
        if (const int pose = pose_of_[o.view]; pose >= 0)
            poses_[static_cast<std::size_t>(pose)].tracks.push_back(o);
    const bool anchored = anchor_ > 0 && std::ranges::any_of(poses_, [](const Pose& pose) {
                              return !pose.tracks.empty();
                          });
    if (!options.camera_lr) rate_px_ = anchored ? kAnchoredRate_px : kFreeRate_px;
    std::vector<PoseMetric> metrics;
    for (Pose& pose : poses_) {
        metrics.push_back(pose.metric);
        const std::size_t step = pose.tracks.size() / kMostTracks + 1;
        std::vector<TrackObservation> some;
        for (std::size_t k = 0; k < pose.tracks.size(); k += step) some.push_back(pose.tracks[k]);
        pose.tracks = std::move(some);
    }
    gauge_ = Gauge(starts, metrics);
}

// Log-linear from camera_from on, as the position's.
double CameraRefinement::rate(int iteration) const {
    const double begin = from_ * iterations_;
    const double share = (iteration - begin) / std::max(iterations_ - begin, 1.0);
    return rate_px_ * std::pow(kLastShare, std::clamp(share, 0.0, 1.0));
}

PoseVector CameraRefinement::step_of(const Pose& pose) const {
    PoseVector x;
    std::copy(pose.trained.value.begin(), pose.trained.value.end(), x.begin());
    return pose.metric.to_step(x);
}

PoseVector CameraRefinement::shutter_step_of(const Pose& pose) const {
    PoseVector x;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = kRowSpread * double(pose.shutter.value[i]);
    return pose.metric.to_step(x);
}

// Half the mean of the squared error over the camera's tracks, by Huber's loss: d/d(camera). A
// point was seen by the camera of its row.
void CameraRefinement::add_anchor(const Pose& pose, CameraGradient& d) const {
    if (pose.tracks.empty()) return;
    const Camera& middle = camera(pose.view);
    const double weight = anchor_ / static_cast<double>(pose.tracks.size());
    for (const TrackObservation& o : pose.tracks) {
        const glm::dvec3& x = points_[o.point];
        const double time = o.at_px.y / middle.height - 0.5;
        const Camera c = camera_at_row(middle, time);
        const glm::dvec3 p = c.rotation * x + c.translation;
        if (!(p.z > 0)) continue;
        const glm::dvec2 ratio(p.x / p.z, p.y / p.z);
        // What was seen is a pixel of the photo, whatever the intrinsics become.
        const glm::dvec2 error = glm::dvec2(c.fx * ratio.x + c.cx, c.fy * ratio.y + c.cy) - o.at_px;
        const glm::dvec2 e =
            weight * error * std::min(1.0, kHuberPx / std::max(glm::length(error), 1e-12));
        const glm::dvec3 d_p(c.fx * e.x / p.z, c.fy * e.y / p.z,
                             -(c.fx * e.x * ratio.x + c.fy * e.y * ratio.y) / p.z);
        if (middle.shutter.active) {
            const glm::dvec3 angle = time * middle.shutter.turn;
            const glm::dvec3 of_middle = glm::transpose(exp_rotation(angle)) * d_p;
            d.d_turn += time * (glm::transpose(left_jacobian(angle)) * glm::cross(p, d_p));
            d.d_move -= time * of_middle;
            d.d_rotation += glm::outerProduct(of_middle, x);
            d.d_translation += of_middle;
        } else {
            d.d_rotation += glm::outerProduct(d_p, x);
            d.d_translation += d_p;
        }
        d.d_fx += e.x * ratio.x;
        d.d_fy += e.y * ratio.y;
        d.d_cx += e.x;
        d.d_cy += e.y;
    }
}

// rotation = E(turn) R, translation = E(turn) t + move: d(turn) turns both by J d(turn) on the
// left.
PoseVector CameraRefinement::pose_gradient(const Pose& pose, const CameraGradient& d) const {
    const Camera& now = camera(pose.view);
    const PoseVector step = step_of(pose);
    const glm::dvec3 turn(step[0], step[1], step[2]), move(step[3], step[4], step[5]);
    glm::dvec3 by_left = glm::cross(now.translation - move, d.d_translation);
    for (int c = 0; c < 3; ++c) by_left += glm::cross(now.rotation[c], d.d_rotation[c]);
    const glm::dvec3 by_turn = glm::transpose(left_jacobian(turn)) * by_left;
    return pose.metric.gradient(
        {by_turn.x, by_turn.y, by_turn.z, d.d_translation.x, d.d_translation.y, d.d_translation.z});
}

bool CameraRefinement::step(int iteration, std::span<const CameraVisit> visits, double share) {
    if (iteration <= from_ * iterations_) return false;
    const double now = share * rate(iteration);
    std::map<int, std::array<double, 4>> by_group;
    for (const CameraVisit& visit : visits) {
        Pose& pose =
            poses_[static_cast<std::size_t>(pose_of_[static_cast<std::size_t>(visit.view)])];
        CameraGradient d = visit.gradient;
        const double x = double(visit.width) / camera(visit.view).width;  // photos may be smaller
        const double y = double(visit.height) / camera(visit.view).height;
        d.d_fx *= x, d.d_cx *= x, d.d_fy *= y, d.d_cy *= y;
        add_anchor(pose, d);
        const PoseVector gradient = pose_gradient(pose, d);
        const glm::dvec4& unit =
            groups_[static_cast<std::size_t>(group_of_[static_cast<std::size_t>(visit.view)])].unit;
        const std::array own{d.d_fx, d.d_fy, d.d_cx, d.d_cy};
        bool finite = true;
        for (const double value : gradient) finite &= std::isfinite(value);
        for (const double value : own) finite &= std::isfinite(value);
        for (int c = 0; c < 3; ++c)
            finite &= std::isfinite(d.d_turn[c]) && std::isfinite(d.d_move[c]);
        if (!finite) continue;
        auto& sum = by_group[group_of_[static_cast<std::size_t>(visit.view)]];
        for (std::size_t i = 0; i < 4; ++i) sum[i] += own[i] * unit[static_cast<int>(i)];
        pose.trained.step(gradient, now);
        if (shutters_) {
            PoseVector by_shutter = pose.metric.gradient(
                {d.d_turn.x, d.d_turn.y, d.d_turn.z, -d.d_move.x, -d.d_move.y, -d.d_move.z});
            for (double& value : by_shutter) value *= kRowSpread;
            pose.shutter.step(by_shutter, now);
        }
    }
    for (const auto& [number, gradient] : by_group) {
        Group& group = groups_[static_cast<std::size_t>(number)];
        group.trained.step(gradient, kIntrinsicsShare * now / group.trained_views);
    }
    std::vector<PoseVector> x;
    for (const Pose& pose : poses_) {
        x.emplace_back();
        std::copy(pose.trained.value.begin(), pose.trained.value.end(), x.back().begin());
    }
    gauge_.remove(x);
    for (std::size_t p = 0; p < poses_.size(); ++p)
        for (std::size_t i = 0; i < 6; ++i)
            poses_[p].trained.value[i] = static_cast<float>(x[p][i]);
    place_cameras();
    return true;
}

void CameraRefinement::place_cameras() {
    for (std::size_t v = 0; v < cameras_.size(); ++v) {
        const int pose = pose_of_[v];
        cameras_[v] = start_[v];
        cameras_[v].shutter.active |= shutters_;  // of held-out ones, too: they may be aligned
        if (pose >= 0) {
            const Pose& own = poses_[static_cast<std::size_t>(pose)];
            cameras_[v] = moved_camera(start_[v], step_of(own));
            if (shutters_) {
                const PoseVector s = shutter_step_of(own);
                cameras_[v].shutter = {true, start_[v].shutter.turn + glm::dvec3(s[0], s[1], s[2]),
                                       start_[v].shutter.move - glm::dvec3(s[3], s[4], s[5])};
            }
        }
        const Group& group = groups_[static_cast<std::size_t>(group_of_[v])];
        const auto& y = group.trained.value;
        cameras_[v].fx += double(y[0]) * group.unit.x;
        cameras_[v].fy += double(y[1]) * group.unit.y;
        cameras_[v].cx += double(y[2]);
        cameras_[v].cy += double(y[3]);
    }
}

CameraMoves CameraRefinement::moves() const {
    CameraMoves all;
    std::vector<double> px, degrees, rolled;
    for (const Pose& pose : poses_) {
        rolled.push_back(pose.metric.shift_px(shutter_step_of(pose)));
        const PoseVector step = step_of(pose);
        px.push_back(pose.metric.shift_px(step));
        degrees.push_back(glm::length(glm::dvec3(step[0], step[1], step[2])) * 180 /
                          3.14159265358979324);
    }
    all.cameras = px.size();
    all.largest_px = *std::max_element(px.begin(), px.end());
    all.largest_degrees = *std::max_element(degrees.begin(), degrees.end());
    all.shutters = shutters_;
    all.largest_rolled_px = *std::max_element(rolled.begin(), rolled.end());
    all.median_rolled_px = nearest_rank(rolled, 0.5);
    all.median_px = nearest_rank(px, 0.5);
    all.median_degrees = nearest_rank(degrees, 0.5);
    for (std::size_t v = 0; v < cameras_.size(); ++v) {
        const Camera &a = start_[v], &b = cameras_[v];
        all.largest_focal =
            std::max({all.largest_focal, std::abs(b.fx / a.fx - 1), std::abs(b.fy / a.fy - 1)});
        all.largest_centre_px =
            std::max({all.largest_centre_px, std::abs(b.cx - a.cx), std::abs(b.cy - a.cy)});
    }
    return all;
}

std::vector<float> CameraRefinement::state() const {
    std::vector<float> values;
    const auto add = [&](const auto& trained) {
        for (const auto* part : {&trained.value, &trained.first, &trained.second})
            values.insert(values.end(), part->begin(), part->end());
        values.push_back(trained.visits);
    };
    for (const Pose& pose : poses_) {
        add(pose.trained);
        if (shutters_) add(pose.shutter);
    }
    for (const Group& group : groups_) add(group.trained);
    return values;
}

std::vector<float> CameraRefinement::with_shutters(const std::vector<float>& state) const {
    std::vector<float> with;
    for (std::size_t p = 0; p < poses_.size(); ++p) {
        const auto pose = state.begin() + static_cast<std::ptrdiff_t>(p * kPoseFloats);
        with.insert(with.end(), pose, pose + kPoseFloats);
        with.insert(with.end(), kPoseFloats, 0.0f);
    }
    with.insert(with.end(),
                state.begin() + static_cast<std::ptrdiff_t>(poses_.size() * kPoseFloats),
                state.end());
    return with;
}

void CameraRefinement::restore(const std::vector<float>& state) {
    const bool shutters = tries_shutters_ ? state.size() == state_size(true) : shutters_;
    if (state.size() != state_size(shutters))
        throw Error("refined cameras",
                    fmt::format("{} values instead of {}", state.size(), state_size(shutters)),
                    "Restore what state() gave for these photos.");
    shutters_ = shutters;
    auto at = state.begin();
    const auto take = [&](auto& trained) {
        for (auto* part : {&trained.value, &trained.first, &trained.second}) {
            std::copy_n(at, part->size(), part->begin());
            at += static_cast<std::ptrdiff_t>(part->size());
        }
        trained.visits = *at++;
    };
    for (Pose& pose : poses_) {
        take(pose.trained);
        if (shutters_) take(pose.shutter);
    }
    for (Group& group : groups_) take(group.trained);
    place_cameras();
}

namespace {

constexpr int kSteps = 40;
constexpr double kFirstRate_px = 0.2, kLastRate_px = 0.01;
constexpr double kAlignBeta1 = 0.8, kAlignBeta2 = 0.95;
constexpr std::size_t kMostPlaces = 5'000;

GradientOptions gradient_options(const Accuracy& accuracy) {
    GradientOptions options;
    options.accuracy = accuracy;
    options.camera = true;
    return options;
}

// Adam on the coordinates of a step.
struct AlignmentStep {
    PoseVector first{}, second{};

    PoseVector step(const PoseVector& d, int number, double rate) {
        PoseVector x{};
        for (std::size_t i = 0; i < 6; ++i) {
            first[i] = kAlignBeta1 * first[i] + (1 - kAlignBeta1) * d[i];
            second[i] = kAlignBeta2 * second[i] + (1 - kAlignBeta2) * d[i] * d[i];
            const double size = std::sqrt(second[i] / (1 - std::pow(kAlignBeta2, number + 1)));
            if (size > 0) x[i] = -rate * first[i] / (1 - std::pow(kAlignBeta1, number + 1)) / size;
        }
        return x;
    }
};

// The mean squared error of the picture and its gradient.
double squared_error(const ImageF& image, const ImageF& truth, const ImageU8& photo, bool masked,
                     ImageF& d_image) {
    double sum = 0, count = 0;
    const std::size_t pixels = std::size_t(photo.width) * photo.height;
    for (std::size_t p = 0; p < pixels; ++p) {
        const bool counts = !masked || photo.data[4 * p + 3] >= 128;
        count += counts ? 3 : 0;
        for (std::size_t c = 3 * p; c < 3 * p + 3; ++c) {
            const float error = counts ? image.data[c] - truth.data[c] : 0.0f;
            d_image.data[c] = 2 * error;
            sum += double(error) * error;
        }
    }
    for (float& d : d_image.data) d /= static_cast<float>(std::max(count, 1.0));
    return sum / std::max(count, 1.0);
}

// d/d(step) where the step is none: turns act on the left.
PoseVector by_step(const Camera& camera, const CameraGradient& d) {
    glm::dvec3 turn = glm::cross(camera.translation, d.d_translation);
    for (int c = 0; c < 3; ++c) turn += glm::cross(camera.rotation[c], d.d_rotation[c]);
    return {turn.x, turn.y, turn.z, d.d_translation.x, d.d_translation.y, d.d_translation.z};
}

}  // namespace

CameraAlignment::CameraAlignment(Device& device, const SplatModel& model, const Accuracy& accuracy)
    : renderer_(device, model, gradient_options(accuracy)) {
    const std::size_t step = model.size() / kMostPlaces + 1;
    for (std::size_t i = 0; i < model.size(); i += step)
        places_.push_back(glm::dvec3(model.position[3 * i], model.position[3 * i + 1],
                                     model.position[3 * i + 2]) +
                          model.origin);
}

Camera CameraAlignment::align(const Camera& camera, const ImageU8& photo,
                              const glm::vec3& background, bool alpha_is_mask) {
    const PoseMetric metric(camera, places_, depth_);
    const ImageF truth = composite(photo, background);
    ImageF d_image(photo.width, photo.height, 3);
    Camera now = camera, best = camera;
    AlignmentStep of_pose, of_shutter;
    double least = 0;
    for (int step = 0; step <= kSteps; ++step) {
        const double error =
            squared_error(renderer_.render(now, background), truth, photo, alpha_is_mask, d_image);
        if (step == 0 || error < least) {
            least = error;
            best = now;
        }
        if (step == kSteps) break;
        const ViewGradients view = renderer_.backward(d_image);
        const PoseVector d = metric.gradient(by_step(now, *view.d_camera));
        const CameraGradient& g = *view.d_camera;
        const PoseVector d_shutter = metric.gradient(
            {g.d_turn.x, g.d_turn.y, g.d_turn.z, -g.d_move.x, -g.d_move.y, -g.d_move.z});
        const double rate =
            kFirstRate_px * std::pow(kLastRate_px / kFirstRate_px, double(step) / kSteps);
        now = moved_camera(now, metric.to_step(of_pose.step(d, step, rate)));
        if (!now.shutter.active) continue;
        PoseVector x = of_shutter.step(d_shutter, step, rate);
        for (double& value : x) value *= kRowSpread;
        const PoseVector s = metric.to_step(x);
        now.shutter.turn += glm::dvec3(s[0], s[1], s[2]);
        now.shutter.move -= glm::dvec3(s[3], s[4], s[5]);
    }
    return best;
}

}  // namespace darb
