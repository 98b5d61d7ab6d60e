// Near-plane care: the rule that says when the Jacobian must be clamped. Near the plane of a camera
// the projection's Jacobian grows without bound to the side, and the affine picture of a splat
// beside the view fans out over it; so x/z and y/z are clamped to the picture and a margin. Where
// no splat beyond the margin can touch a picture by its own reach, the clamp changes no bit.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <vector>

#include "engine/core/on_threads.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/plan/effect_plan.h"
#include "engine/plan/effect_rules.h"
#include "engine/raster/frame_view.h"

namespace darb {

namespace {

constexpr double kSmallestCutoff = 1.0 / 1024;  // of the accuracy settings: splats reach farthest
constexpr double kSlack = 1.02, kSlack_px = 1;  // over the rounding of float32
// Beyond so many splats times cameras the rule would take seconds; then the clamp stays.
constexpr std::uint64_t kMostProjections = 100'000'000;

struct Ball {
    glm::dvec3 centre;     // world
    double reach2;         // Mahalanobis
    double deviation = 0;  // the largest, world
};

Ball ball_of(const SplatModel& model, std::size_t i) {
    const float* p = &model.position[3 * i];
    const float* s = &model.log_scale[3 * i];
    Ball ball;
    ball.centre = glm::dvec3(p[0], p[1], p[2]) + model.origin;
    const double logit =
        std::clamp(double{model.opacity_logit[i]}, -OPACITY_LOGIT_LIMIT, OPACITY_LOGIT_LIMIT);
    const double opacity = sigmoid(logit), support = kernel_support(model.kernel);
    const double exponent =
        kernel_has_shape(model.kernel)
            ? splat_exponent(model.kernel, model.footprint, double{model.shape[i]})
            : 0;
    const double unbounded =
        kernel_has_shape(model.kernel)
            ? shaped_kernel(model.kernel).reach(model.footprint, exponent, opacity, kSmallestCutoff)
            : 2 * std::log(opacity / kSmallestCutoff);
    ball.reach2 = opacity > kSmallestCutoff ? (std::isfinite(support) ? support : unbounded) : 0;
    const double largest =
        std::clamp(double{std::max({s[0], s[1], s[2]})}, -LOG_SCALE_LIMIT, LOG_SCALE_LIMIT);
    const double psi = kernel_has_shape(model.kernel)
                           ? shaped_kernel(model.kernel).covariance_scale(model.footprint, exponent)
                           : covariance_scale(model.kernel, model.footprint);
    ball.deviation = std::exp(largest) * std::sqrt(psi);
    return ball;
}

// x or y of a camera: focal length and centre in px, the clamp's limits of the ratio, the size.
struct Axis {
    double focal, centre, low, high;
    int pixels;
};

// One axis: whether [-extent, extent] around the projected centre meets the picture. The row of the
// Jacobian is f/z (1, 0, -ratio), its length bounds what the covariance becomes. The clamped ratio
// is the larger one where the picture lies far off the axis, so that it counts too.
bool meets(const Axis& axis, double z, double ratio, const Ball& ball) {
    const double along = ball.deviation * axis.focal / z;
    const double steepest =
        std::max(std::abs(ratio), std::abs(std::clamp(ratio, axis.low, axis.high)));
    const double variance = along * along * (1 + steepest * steepest) + LOW_PASS_DEFAULT;
    const double extent = kSlack * std::sqrt(ball.reach2 * variance) + kSlack_px;
    const double at = axis.focal * ratio + axis.centre;
    return at + extent >= 0 && at - extent <= axis.pixels + TILE_SIZE;
}

bool needs_care(const Camera& camera, const gpu::CameraData& data, const Ball& ball, double near) {
    const glm::dvec3 p = camera.rotation * ball.centre + camera.translation;
    if (!(p.z > near * (1 - 1e-5))) return false;  // takes no part in the frame
    const double x = p.x / p.z, y = p.y / p.z;
    constexpr double kEdge = 1e-4;  // of rounding, and of a principal point that counts as centred
    const auto inside = [&](double ratio, double low, double high) {
        const double edge = kEdge * std::max(1.0, std::abs(ratio));
        return ratio > low + edge && ratio < high - edge;
    };
    if (inside(x, data.ratio_min.x, data.ratio_max.x) &&
        inside(y, data.ratio_min.y, data.ratio_max.y))
        return false;
    if (camera.lens.active) return true;  // its Jacobian has no such bound
    const glm::vec2 low = data.ratio_min, high = data.ratio_max;
    return meets({camera.fx, camera.cx, low.x, high.x, camera.width}, p.z, x, ball) &&
           meets({camera.fy, camera.cy, low.y, high.y, camera.height}, p.z, y, ball);
}

}  // namespace

EffectRow near_rule(const SplatModel& model, const std::vector<View>& views, float near_plane) {
    EffectRow row;
    if (model.size() == 0) {
        row.reason = "there are no splats";
        return row;
    }
    if (views.empty() || model.size() * views.size() > kMostProjections) {
        row.on = true;
        row.reason = views.empty() ? "no cameras are named: a splat may lie beside any"
                                   : "too many splats and cameras to look at each";
        return row;
    }
    std::vector<gpu::CameraData> data;
    for (const View& view : views) data.push_back(camera_data(view.camera, model.origin));
    const std::size_t threads = std::max(1u, std::thread::hardware_concurrency());
    std::vector<std::size_t> found(threads, 0);
    std::atomic<std::size_t> next{0};
    const auto look = [&] {
        std::size_t t = next++;
        for (; t < threads; t = next++)
            for (std::size_t i = t; i < model.size(); i += threads) {
                const Ball ball = ball_of(model, i);
                if (!(ball.reach2 > 0)) continue;
                bool needs = false;
                for (std::size_t v = 0; v < views.size() && !needs; ++v)
                    needs = needs_care(views[v].camera, data[v], ball, near_plane);
                found[t] += needs ? 1 : 0;
            }
    };
    on_threads(threads, look);
    std::size_t count = 0;
    for (const std::size_t n : found) count += n;
    row.measured = static_cast<double>(count);
    row.on = count > 0;
    row.reason = fmt::format("{} of {} splats beside a camera may reach into its picture", count,
                             model.size());
    return row;
}

}  // namespace darb
