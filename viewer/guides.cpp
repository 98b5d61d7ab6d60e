// SPDX-License-Identifier: MIT
#include "viewer/guides.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_model.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr double kGroundShare = 0.02;
constexpr std::size_t kGroundSplats = 20'000;
constexpr std::size_t kMeasuredCameras = 500;
constexpr double kReach = 1.5;  // radii
constexpr double kCells = 25;   // at most, along a side
constexpr double kNear = 1e-3;  // world units before the eye at which a line ends
constexpr double kGrab = 10;    // px

int main_axis(const glm::dvec3& v) {
    int best = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(v[i]) > std::abs(v[best])) best = i;
    return best;
}

glm::dvec3 unit(int axis, double sign = 1) {
    glm::dvec3 v(0.0);
    v[axis] = sign;
    return v;
}

// The next of 1, 2, 5, 10, ... that is not below the value.
double round_step(double least) {
    const double power = std::pow(10.0, std::floor(std::log10(least)));
    for (const double times : {1.0, 2.0, 5.0})
        if (times * power >= least * (1 - 1e-9)) return times * power;
    return 10 * power;
}

}  // namespace

glm::dvec3 side_of(const glm::dvec3& up, Side side) {
    const int axis = main_axis(up);
    if (side == Side::top) return up;
    if (axis == 2) return side == Side::front ? unit(1, -1) : unit(0);
    if (axis == 0) return side == Side::front ? unit(2, -1) : unit(1);
    // seen with up on top, the right is where the view's right is
    return side == Side::front ? unit(2, -1) : unit(0, up.y > 0 ? -1 : 1);
}

double ground_height(const SplatModel& model, const Bounds& subject, const glm::dvec3& up) {
    const std::size_t step = model.size() / kGroundSplats + 1;
    std::vector<double> heights;
    for (std::size_t i = 0; i < model.size(); i += step) {
        const glm::dvec3 p = position_of(model, i);
        if (glm::distance(p, subject.centre) <= kReach * subject.radius)
            heights.push_back(glm::dot(p, up));
    }
    if (heights.empty()) return glm::dot(subject.centre, up) - subject.radius;
    const auto at =
        heights.begin() + static_cast<std::ptrdiff_t>(kGroundShare * double(heights.size() - 1));
    std::nth_element(heights.begin(), at, heights.end());
    return *at;
}

GroundGrid ground_grid(const Bounds& subject, const glm::dvec3& up, double height,
                       double metres_per_unit) {
    GroundGrid grid;
    const double reach = kReach * subject.radius;
    const double unit_m = metres_per_unit > 0 ? metres_per_unit : 1;
    if (!(reach > 0) || !std::isfinite(reach)) return grid;
    grid.step = round_step(2 * reach * unit_m / kCells) / unit_m;
    // the axes of the file that lie across, made level
    const int axis = main_axis(up);
    glm::dvec3 u = unit((axis + 1) % 3);
    u = glm::normalize(u - glm::dot(u, up) * up);
    const glm::dvec3 v = glm::cross(up, u);
    const int count = static_cast<int>(std::ceil(reach / grid.step));
    const double half = count * grid.step;
    // lines pass through the origin of the file, as far as it goes
    const double cu = std::round(glm::dot(subject.centre, u) / grid.step) * grid.step;
    const double cv = std::round(glm::dot(subject.centre, v) / grid.step) * grid.step;
    for (int i = -count; i <= count; ++i) {
        const double at = i * grid.step;
        const glm::dvec3 across = height * up + (cu + at) * u, along = height * up + (cv + at) * v;
        grid.lines.push_back({across + (cv - half) * v, across + (cv + half) * v});
        grid.lines.push_back({along + (cu - half) * u, along + (cu + half) * u});
    }
    return grid;
}

std::array<AxisBall, 6> axis_balls(const glm::dmat3& rotation, const glm::dvec2& centre,
                                   double scale) {
    std::array<AxisBall, 6> balls;
    for (int i = 0; i < 6; ++i) {
        const bool positive = i % 2 == 0;
        const glm::dvec3 seen = rotation * unit(i / 2, positive ? 1 : -1);
        balls[static_cast<std::size_t>(i)] = {
            i / 2, positive, centre + kAxisReach * scale * glm::dvec2(seen), seen.z};
    }
    std::ranges::sort(balls, std::greater(), &AxisBall::depth);
    return balls;
}

std::optional<AxisBall> axis_at(const std::array<AxisBall, 6>& balls, const glm::dvec2& px,
                                double scale) {
    for (auto ball = balls.rbegin(); ball != balls.rend(); ++ball)
        if (glm::distance(ball->centre, px) <= kAxisBall * scale) return *ball;
    return {};
}

glm::dvec3 direction_of(const AxisBall& ball) {
    return unit(ball.axis, ball.positive ? 1 : -1);
}

Frustum frustum_of(const Camera& camera, double depth) {
    const glm::dmat3 to_world = glm::transpose(camera.rotation);
    Frustum f;
    f.eye = camera.centre();
    for (int corner = 0; corner < 4; ++corner) {
        const double x = corner == 1 || corner == 2 ? camera.width : 0;
        const double y = corner >= 2 ? camera.height : 0;
        f.corners[static_cast<std::size_t>(corner)] =
            f.eye + to_world * (depth * glm::dvec3((x - camera.cx) / camera.fx,
                                                   (y - camera.cy) / camera.fy, 1));
    }
    return f;
}

double frustum_depth(std::span<const View> views, double radius) {
    std::vector<double> nearest;
    const std::size_t step = views.size() / kMeasuredCameras + 1;
    for (std::size_t v = 0; v < views.size(); v += step) {
        const View& view = views[v];
        double least = std::numeric_limits<double>::infinity();
        for (const View& other : views)
            if (&other != &view)
                least = std::min(least, glm::distance(view.camera.centre(), other.camera.centre()));
        if (std::isfinite(least)) nearest.push_back(least);
    }
    if (nearest.empty()) return 0.1 * radius;
    const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
    std::nth_element(nearest.begin(), middle, nearest.end());
    return std::min(*middle > 0 ? 0.4 * *middle : 0.1 * radius, radius / 8);
}

std::optional<std::array<glm::dvec2, 2>> pixels_of(const Camera& c, const Segment& line) {
    glm::dvec3 p = c.rotation * line[0] + c.translation, q = c.rotation * line[1] + c.translation;
    if (p.z < kNear && q.z < kNear) return {};
    glm::dvec3& behind = p.z < q.z ? p : q;
    const glm::dvec3& ahead = p.z < q.z ? q : p;
    if (behind.z < kNear)
        behind = glm::mix(ahead, behind, (ahead.z - kNear) / (ahead.z - behind.z));
    const auto at = [&](const glm::dvec3& v) {
        return glm::dvec2(c.fx * v.x / v.z + c.cx, c.fy * v.y / v.z + c.cy);
    };
    return std::array{at(p), at(q)};
}

std::optional<int> camera_at(std::span<const View> views, double depth, const Camera& seen_by,
                             const glm::dvec2& px, double scale) {
    std::optional<int> best, inside;
    double nearest = kGrab * scale, nearest_depth = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < views.size(); ++v) {
        const Frustum f = frustum_of(views[v].camera, depth);
        int turns = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            const auto ray = pixels_of(seen_by, {f.eye, f.corners[k]});
            const auto side = pixels_of(seen_by, {f.corners[k], f.corners[(k + 1) % 4]});
            if (!ray || !side) {
                turns = 8;  // partly behind the eye
                continue;
            }
            for (const auto& line : {*ray, *side})
                if (const double d = distance_to_segment(px, line[0], line[1]); d < nearest) {
                    nearest = d;
                    best = static_cast<int>(v);
                }
            const glm::dvec2 along = (*side)[1] - (*side)[0], to = px - (*side)[0];
            turns += along.x * to.y - along.y * to.x > 0 ? 1 : 0;
        }
        const double away = (seen_by.rotation * f.eye + seen_by.translation).z;
        if ((turns == 0 || turns == 4) && away < nearest_depth) {
            nearest_depth = away;
            inside = static_cast<int>(v);
        }
    }
    return best ? best : inside;
}

std::array<double, 2> depth_range(const Camera& camera, const Bounds& bounds) {
    const double depth =
        glm::dot(glm::transpose(camera.rotation)[2], bounds.centre - camera.centre());
    return {std::max(0.0, depth - kReach * bounds.radius),
            std::max(depth, 0.0) + kReach * bounds.radius};
}

}  // namespace darb
