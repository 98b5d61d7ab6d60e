// SPDX-License-Identifier: MIT
#include "engine/scene/subject.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

constexpr std::size_t kSplatsOfDensity = 100'000, kSplatsOfDepth = 20'000, kMostCameras = 64;
constexpr float kLogitOfTenth = -2.2f;
constexpr double kTail = 0.02;       // left out at each end
constexpr double kReach = 2.5;       // times the median distance: what is farther is background
constexpr int kMostRounds = 20;      // rounds in which splats are left out, or axes reweighted
constexpr int kCells = 16;           // per side, over the middle half of a picture, for depths
constexpr double kOpaque = 0.7;      // optical depth of half the light
constexpr double kPrior = 0.03;      // weight of the seen depth, relative to that of the axes
constexpr double kLeastMiss = 0.02;  // share of the median depth: an axis that passes as near
                                     // counts as a hit
constexpr double kAhead = 0.1;       // share of the seen depth: a nearer point is not in front of a
                                     // camera
constexpr double kFarthest = 10;  // times the seen depth: a farther point is not what is looked at
constexpr double kAgree = 0.6;    // share of the cameras that have the point in front of them
constexpr double kOneWay = 0.5;   // length of the mean of their directions

struct Weighed {
    glm::dvec3 at;  // relative to the model's origin
    double weight;
};

glm::dvec3 forward_of(const Camera& camera) {
    return glm::transpose(camera.rotation)[2];
}

double distance_to_axis(const glm::dvec3& point, const Camera& camera) {
    return glm::length(glm::cross(point - camera.centre(), forward_of(camera)));
}

double depth_of(const glm::dvec3& point, const Camera& camera) {
    return glm::dot(point - camera.centre(), forward_of(camera));
}

/// Half of the picture's smaller side, at depth 1.
double half_side(const Camera& camera) {
    return 0.5 * std::min(camera.width / camera.fx, camera.height / camera.fy);
}

double weighted_median(std::vector<std::pair<double, double>>& values) {
    std::sort(values.begin(), values.end());
    double total = 0, sum = 0;
    for (const auto& [value, weight] : values) total += weight;
    for (const auto& [value, weight] : values)
        if ((sum += weight) >= total / 2) return value;
    return values.back().first;
}

std::vector<Weighed> opaque_splats(const SplatModel& m, float least_logit) {
    std::vector<Weighed> splats;
    const std::size_t step = std::max<std::size_t>(1, m.size() / kSplatsOfDensity);
    for (std::size_t i = 0; i < m.size(); i += step) {
        if (m.opacity_logit[i] < least_logit) continue;
        const float* p = &m.position[3 * i];
        splats.push_back({{p[0], p[1], p[2]}, std::max(sigmoid(m.opacity_logit[i]), 1e-6)});
    }
    return splats;
}

/// The distances from their median, and the median of those.
double distances_to_median(const std::vector<Weighed>& splats, std::vector<double>& distances) {
    glm::dvec3 middle(0.0);
    std::vector<std::pair<double, double>> values(splats.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < splats.size(); ++i)
            values[i] = {splats[i].at[axis], splats[i].weight};
        middle[axis] = weighted_median(values);
    }
    distances.resize(splats.size());
    for (std::size_t i = 0; i < splats.size(); ++i) {
        distances[i] = glm::distance(splats[i].at, middle);
        values[i] = {distances[i], splats[i].weight};
    }
    return weighted_median(values);
}

/// A splat in a cell of the picture's middle.
struct Seen {
    double depth, covers;  // covers: optical depth that it adds to the cell
};

/// Depth of the first surface in a cell; nothing where light passes through.
std::optional<double> surface_of(std::vector<Seen>& cell) {
    std::sort(cell.begin(), cell.end(),
              [](const Seen& a, const Seen& b) { return a.depth < b.depth; });
    double sum = 0;
    for (const Seen& seen : cell)
        if ((sum += seen.covers) >= kOpaque) return seen.depth;
    return {};
}

/// A camera that sees something.
struct Looking {
    const Camera* camera;
    double depth;  // median depth of the splats it sees
};

std::vector<Looking> looking_cameras(const SplatModel& model, std::span<const Camera> cameras) {
    std::vector<Looking> looking;
    const std::size_t count = std::min(cameras.size(), kMostCameras);
    for (std::size_t i = 0; i < count; ++i) {
        const Camera& camera = cameras[i * cameras.size() / count];
        if (const auto depth = seen_depth(model, camera)) looking.push_back({&camera, *depth});
    }
    return looking;
}

glm::dvec3 median_of(const std::vector<glm::dvec3>& points) {
    glm::dvec3 middle(0.0);
    std::vector<double> values(points.size());
    for (int axis = 0; axis < 3; ++axis) {
        std::transform(points.begin(), points.end(), values.begin(),
                       [axis](const glm::dvec3& p) { return p[axis]; });
        middle[axis] = median(values);
    }
    return middle;
}

/// Least squares of the distances to the axes, whose weights fall with distance (Cauchy's weights).
glm::dvec3 nearest_to_axes(const std::vector<Looking>& looking, const glm::dvec3& seen) {
    glm::dvec3 point = seen;
    std::vector<double> depths, misses(looking.size()), weights(looking.size(), 1.0);
    for (const Looking& one : looking) depths.push_back(one.depth);
    const double least_miss = kLeastMiss * median(depths);
    for (int round = 0; round < kMostRounds; ++round) {
        glm::dmat3 sum(0.0);
        glm::dvec3 right(0.0);
        double total = 0;
        for (std::size_t i = 0; i < looking.size(); ++i) {
            const glm::dvec3 axis = forward_of(*looking[i].camera);
            const glm::dmat3 across =
                weights[i] * (glm::dmat3(1.0) - glm::outerProduct(axis, axis));
            sum += across;
            right += across * (looking[i].camera->centre() - seen);
            total += weights[i];
        }
        sum += kPrior * total * glm::dmat3(1.0);
        point = seen + glm::inverse(sum) * right;
        for (std::size_t i = 0; i < looking.size(); ++i)
            misses[i] = distance_to_axis(point, *looking[i].camera);
        const double usual = std::max(1.5 * median(misses), least_miss);
        for (std::size_t i = 0; i < looking.size(); ++i)
            weights[i] = 1 / (1 + misses[i] * misses[i] / (usual * usual));
    }
    return point;
}

/// Whether most cameras have the point in front of them, at a depth at which they see something.
bool is_looked_at(const glm::dvec3& point, const std::vector<Looking>& looking) {
    std::size_t ahead = 0;
    for (const Looking& one : looking) {
        const double depth = depth_of(point, *one.camera);
        ahead += depth > kAhead * one.depth && depth < kFarthest * one.depth;
    }
    return static_cast<double>(ahead) >= kAgree * static_cast<double>(looking.size());
}

/// The distance from the centre that 98 % of the opaque splats do not exceed.
double reach_of_splats(const SplatModel& model, const glm::dvec3& centre) {
    std::vector<double> distances;
    for (const Weighed& splat : opaque_splats(model, kLogitOfTenth))
        distances.push_back(glm::distance(splat.at + model.origin, centre));
    return distances.empty() ? HUGE_VAL : nearest_rank(distances, 1 - kTail);
}

/// The radius that the frames show of the subject.
double radius_of_frames(const Subject& subject, const std::vector<Looking>& looking) {
    std::vector<double> halves, beside;
    for (const Looking& one : looking) {
        if (subject.around) {
            halves.push_back(one.depth);
            beside.push_back(glm::distance(one.camera->centre(), subject.centre));
            continue;
        }
        const double depth = depth_of(subject.centre, *one.camera);
        if (depth <= 0) continue;
        halves.push_back(depth * half_side(*one.camera));
        beside.push_back(distance_to_axis(subject.centre, *one.camera));
    }
    if (halves.empty()) return HUGE_VAL;
    return median(halves) + nearest_rank(beside, 0.8);
}

}  // namespace

Bounds enclosing(const Bounds& a, const Bounds& b) {
    const double apart = glm::distance(a.centre, b.centre);
    if (apart + b.radius <= a.radius) return a;
    if (apart + a.radius <= b.radius) return b;
    const double radius = (apart + a.radius + b.radius) / 2;
    return {a.centre + (radius - a.radius) / apart * (b.centre - a.centre), radius};
}

Bounds dense_bounds(const SplatModel& model) {
    std::vector<Weighed> splats = opaque_splats(model, kLogitOfTenth);
    if (splats.empty()) splats = opaque_splats(model, -HUGE_VALF);
    if (splats.empty()) return {model.origin, 1};
    std::vector<double> values;
    for (int round = 0; round < kMostRounds; ++round) {
        const double most = kReach * distances_to_median(splats, values);
        std::size_t kept = 0;
        for (std::size_t i = 0; i < splats.size(); ++i)
            if (values[i] <= most) splats[kept++] = splats[i];
        if (kept == splats.size()) break;
        splats.resize(kept);
    }
    Bounds bounds;
    values.resize(splats.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < splats.size(); ++i) values[i] = splats[i].at[axis];
        bounds.centre[axis] = (nearest_rank(values, kTail) + nearest_rank(values, 1 - kTail)) / 2;
    }
    for (std::size_t i = 0; i < splats.size(); ++i)
        values[i] = glm::distance(splats[i].at, bounds.centre);
    bounds.radius = std::max(nearest_rank(values, 1 - kTail), 1e-3);
    bounds.centre += model.origin;
    return bounds;
}

std::optional<double> seen_depth(const SplatModel& model, const Camera& camera) {
    std::array<std::vector<Seen>, std::size_t{kCells} * kCells> cells;
    const std::size_t step = std::max<std::size_t>(1, model.size() / kSplatsOfDepth);
    const double side_x = 0.5 * camera.width / kCells, side_y = 0.5 * camera.height / kCells;
    const glm::dvec3 shift = camera.rotation * model.origin + camera.translation;
    for (std::size_t i = 0; i < model.size(); i += step) {
        const float *p = &model.position[3 * i], *s = &model.log_scale[3 * i];
        const glm::dvec3 at = camera.rotation * glm::dvec3(p[0], p[1], p[2]) + shift;
        if (!(at.z > 0)) continue;
        const double x = (camera.fx * at.x / at.z + camera.cx - 0.25 * camera.width) / side_x;
        const double y = (camera.fy * at.y / at.z + camera.cy - 0.25 * camera.height) / side_y;
        if (!(x >= 0 && x < kCells && y >= 0 && y < kCells)) continue;
        // Twice the area of the ellipse at one standard deviation: the integral of a Gaussian.
        const double log_area = double{s[0]} + s[1] + s[2] - std::min({s[0], s[1], s[2]});
        const double area = 2 * std::numbers::pi * std::exp(std::min(log_area, 50.0)) * camera.fx *
                            camera.fy / (at.z * at.z * side_x * side_y);
        const auto cell = static_cast<std::size_t>(y) * kCells + static_cast<std::size_t>(x);
        cells[cell].push_back({at.z, sigmoid(model.opacity_logit[i]) * std::min(area, 1.0) *
                                         static_cast<double>(step)});
    }
    std::vector<double> depths;
    for (std::vector<Seen>& cell : cells)
        if (const auto depth = surface_of(cell)) depths.push_back(*depth);
    if (depths.empty())  // thin everywhere: take the middle of what there is
        for (const std::vector<Seen>& cell : cells)
            for (const Seen& seen : cell) depths.push_back(seen.depth);
    if (depths.empty()) return {};
    return median(depths);
}

Subject subject_of(const SplatModel& model, std::span<const Camera> cameras) {
    const std::vector<Looking> looking = looking_cameras(model, cameras);
    Subject subject;
    if (looking.empty()) {
        static_cast<Bounds&>(subject) = dense_bounds(model);
        return subject;
    }
    std::vector<glm::dvec3> seen, stands;
    glm::dvec3 direction(0.0);
    for (const Looking& one : looking) {
        stands.push_back(one.camera->centre());
        seen.push_back(stands.back() + one.depth * forward_of(*one.camera));
        direction += forward_of(*one.camera) / static_cast<double>(looking.size());
    }
    const glm::dvec3 middle = median_of(seen);
    subject.centre = nearest_to_axes(looking, middle);
    if (!is_looked_at(subject.centre, looking)) {
        subject.around = glm::length(direction) < kOneWay;
        subject.centre = subject.around ? median_of(stands) : middle;
    }
    const double radius =
        std::min(radius_of_frames(subject, looking), reach_of_splats(model, subject.centre));
    subject.radius = radius > 0 && std::isfinite(radius) ? radius : 1e-3;
    return subject;
}

double pivot_depth(const Subject& subject, const SplatModel& model, const Camera& camera) {
    const double ahead = depth_of(subject.centre, camera);
    const double wide = 0.5 * std::hypot(camera.width / camera.fx, camera.height / camera.fy);
    const bool in_picture = ahead > 0 && distance_to_axis(subject.centre, camera) < wide * ahead;
    if (!subject.around && in_picture) return ahead;
    const std::optional<double> seen = seen_depth(model, camera);
    return seen ? *seen : ahead > kAhead * subject.radius ? ahead : subject.radius;
}

glm::dvec3 up_from_name(const std::string& name) {
    const bool negative = name.starts_with('-');
    const std::string axis = name.substr(negative || name.starts_with('+') ? 1 : 0);
    const int i = axis == "x" ? 0 : axis == "y" ? 1 : axis == "z" ? 2 : -1;
    if (i < 0) throw Error("--up", "'" + name + "' is no axis", "Use x, -x, y, -y, z or -z.");
    glm::dvec3 up(0.0);
    up[i] = negative ? -1 : 1;
    return up;
}

std::optional<glm::dvec3> up_of_cameras(std::span<const Camera> cameras) {
    constexpr double kSure = 0.1;
    glm::dvec3 up(0.0), back(0.0);
    for (const Camera& camera : cameras) {
        const glm::dmat3 axes = glm::transpose(camera.rotation);
        up -= axes[1] / static_cast<double>(cameras.size());
        back -= axes[2] / static_cast<double>(cameras.size());
    }
    if (glm::length(up) > kSure) return glm::normalize(up);
    if (glm::length(back) > kSure) return glm::normalize(back);
    return {};
}

namespace {

constexpr std::size_t kSplatsOfFeet = 100'000;
constexpr float kLeastLogit = -2.2f;  // an opacity of a tenth
constexpr double kStrays = 0.005, kFoot = 0.03, kSurely = 1.5, kLying = 2;
struct Standing {
    glm::dvec3 at;
    double weight;
};

/// The weight of a layer times its width.
double footing(const std::vector<Standing>& splats, int axis, double from, double to) {
    double weight = 0, square = 0;
    glm::dvec3 sum(0.0);
    for (const Standing& s : splats) {
        if (s.at[axis] < from || s.at[axis] > to) continue;
        glm::dvec3 across = s.at;
        across[axis] = 0;
        weight += s.weight;
        sum += s.weight * across;
        square += s.weight * glm::dot(across, across);
    }
    if (!(weight > 0)) return 0;
    const double variance = square / weight - glm::dot(sum, sum) / (weight * weight);
    return weight * std::sqrt(std::max(variance, 0.0));
}

/// A value for each end of an axis.
struct Ends {
    double low = 0, high = 0;
};

Ends footing_of_ends(std::vector<Standing>& splats, int axis) {
    std::sort(splats.begin(), splats.end(),
              [axis](const Standing& a, const Standing& b) { return a.at[axis] < b.at[axis]; });
    double total = 0;
    for (const Standing& s : splats) total += s.weight;
    const auto place_of = [&](double share) {
        double sum = 0;
        for (const Standing& s : splats)
            if ((sum += s.weight) >= share * total) return s.at[axis];
        return splats.back().at[axis];
    };
    const double low = place_of(kStrays), high = place_of(1 - kStrays), slab = kFoot * (high - low);
    return {footing(splats, axis, splats.front().at[axis], low + slab),
            footing(splats, axis, high - slab, splats.back().at[axis])};
}

}  // namespace

glm::dvec3 guess_up(const SplatModel& m) {
    std::vector<Standing> splats;
    const size_t step = std::max<size_t>(1, m.size() / kSplatsOfFeet);
    for (size_t i = 0; i < m.size(); i += step) {
        const float* p = &m.position[3 * i];
        const float* s = &m.log_scale[3 * i];
        const double log_area = double{s[0]} + s[1] + s[2] - std::min({s[0], s[1], s[2]});
        const double weight = sigmoid(m.opacity_logit[i]) * std::exp(std::min(log_area, 50.0));
        if (m.opacity_logit[i] < kLeastLogit || !(weight > 0)) continue;
        splats.push_back({{p[0], p[1], p[2]}, weight});
    }
    const glm::dvec3 usual(0, -1, 0);
    if (splats.size() < 100) return usual;
    const Ends y = footing_of_ends(splats, 1), z = footing_of_ends(splats, 2);  // y is down
    if (z.low > kLying * std::max({y.low, y.high, z.high})) return {0, 0, 1};
    return y.low > kSurely * y.high ? -usual : usual;
}

glm::dvec3 usual_front(const glm::dvec3& up) {
    const glm::dvec3 usual =
        std::abs(up.z) > 0.7 ? glm::dvec3(0, up.z > 0 ? -1 : 1, 0) : glm::dvec3(0, 0, -1);
    return glm::normalize(usual - glm::dot(usual, up) * up);
}

namespace {

constexpr double kFieldOfView = 50 * std::numbers::pi / 180;  // horizontal
constexpr double kElevation = 20 * std::numbers::pi / 180;

struct Weighted {
    double value, weight;
};

/// The value below which a share of the weight lies.
double weighted_quantile(std::vector<Weighted> values, double share) {
    std::sort(values.begin(), values.end(),
              [](const Weighted& a, const Weighted& b) { return a.value < b.value; });
    double total = 0, sum = 0;
    for (const Weighted& v : values) total += v.weight;
    for (const Weighted& v : values) {
        sum += v.weight;
        if (sum >= share * total) return v.value;
    }
    return values.back().value;
}

/// Rows: right, down, forward.
glm::dmat3 look_at(const glm::dvec3& from, const glm::dvec3& to, const glm::dvec3& up) {
    const glm::dvec3 forward = glm::normalize(to - from);
    const glm::dvec3 right = glm::normalize(glm::cross(-up, forward));
    return glm::transpose(glm::dmat3(right, glm::cross(forward, right), forward));
}

}  // namespace

SceneBall opaque_ball(const SplatModel& model) {
    DARB_CHECK(model.size() > 0, "no splats");
    std::vector<double> opacity;
    for (const float logit : model.opacity_logit) opacity.push_back(sigmoid(logit));
    SceneBall ball;
    for (int c = 0; c < 3; ++c) {
        std::vector<Weighted> values;
        for (size_t i = 0; i < model.size(); ++i)
            values.push_back({model.position[i * 3 + c], opacity[i]});
        ball.centre[c] = weighted_quantile(std::move(values), 0.5);
    }
    std::vector<Weighted> distances;
    for (size_t i = 0; i < model.size(); ++i) {
        const float* p = &model.position[i * 3];
        distances.push_back({glm::length(glm::dvec3(p[0], p[1], p[2]) - ball.centre), opacity[i]});
    }
    ball.radius = std::max(weighted_quantile(std::move(distances), 0.9), 1e-6);
    return ball;
}

std::vector<Camera> orbit_cameras(const SplatModel& model, int count, int width, int height) {
    const SceneBall ball = opaque_ball(model);
    return orbit_cameras(Bounds{ball.centre + model.origin, ball.radius}, count, width, height,
                         {0, -1, 0});
}

std::vector<Camera> orbit_cameras(const Bounds& ball, int count, int width, int height,
                                  const glm::dvec3& up) {
    const double distance = ball.radius / std::sin(kFieldOfView * 0.5 * height / width);
    const glm::dvec3 front = usual_front(up), across = glm::cross(up, front);
    std::vector<Camera> cameras;
    for (int v = 0; v < count; ++v) {
        const double turn = 2 * std::numbers::pi * v / count;
        const glm::dvec3 side = std::sin(turn) * across + std::cos(turn) * front;
        const glm::dvec3 eye =
            ball.centre + distance * (std::cos(kElevation) * side + std::sin(kElevation) * up);
        Camera camera;
        camera.width = width;
        camera.height = height;
        camera.fx = camera.fy = 0.5 * width / std::tan(0.5 * kFieldOfView);
        camera.cx = 0.5 * width;
        camera.cy = 0.5 * height;
        camera.rotation = look_at(eye, ball.centre, up);
        camera.translation = -(camera.rotation * eye);
        cameras.push_back(camera);
    }
    return cameras;
}

}  // namespace darb
