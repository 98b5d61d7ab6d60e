// SPDX-License-Identifier: MIT
#include "trainer/step/smoothing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/primitives/groups.h"
#include "shaders/shared/effect_args.h"

namespace darb {

namespace {
constexpr int kFilterInterval = 100;  // iterations, as Mip-Splatting
}

SmoothingFilter::SmoothingFilter(Device& device, const ProjectionEffects& effects)
    : device_(&device), commands_(device) {
    SpecConstants constants{{"THREADS", SPLAT_GROUP}};
    add_constants(effects, constants);
    filter_ = Pipeline(device, "smoothing_filter", constants);
}

void SmoothingFilter::update(GpuSplats& splats, const Buffer& cameras, std::uint32_t camera_count) {
    const std::uint64_t bytes = std::uint64_t{std::max(splats.count(), 1u)} * sizeof(float);
    if (splats.smoothing().bytes() != bytes) {
        splats.smoothing() = Buffer();  // first, so that there are never two
        splats.smoothing() = Buffer(*device_, "smoothing", bytes);
    }
    if (splats.count() == 0) return;
    const Groups g = groups_for(splats.count());
    commands_.begin();
    commands_.pass("smoothing filter");
    commands_.dispatch(filter_, gpu::SmoothingArgs{splats.count(), camera_count},
                       {cameras, splats.parameters(kPosition), splats.smoothing()}, g.x, g.y);
    if (splats.frozen() > 0)  // they are as a file holds them: the filter is worked in
        commands_.fill({splats.smoothing(), 0, std::uint64_t{splats.frozen()} * 4}, 0);
    commands_.submit_and_wait();
}

TrainedSmoothing::TrainedSmoothing(Device& device, const ProjectionEffects& effects,
                                   const std::vector<gpu::CameraData>& cameras)
    : filter_(device, effects),
      cameras_(upload_cameras(device, cameras)),
      camera_count_(static_cast<std::uint32_t>(cameras.size())) {}

void TrainedSmoothing::advance(int begin, int end) {
    if (end / kFilterInterval != begin / kFilterInterval) stale_ = true;
}

void TrainedSmoothing::update(GpuSplats& splats) {
    filter_.update(splats, cameras_, camera_count_);
    stale_ = false;
}

SplatModel bake_smoothing(const SplatModel& model, const std::vector<float>& filter) {
    if (filter.size() < model.size())
        throw Error("smoothing",
                    fmt::format("{} filters for {} splats", filter.size(), model.size()),
                    "Give one a splat.");
    SplatModel baked = model;
    for (std::size_t i = 0; i < model.size(); ++i) {
        double kept = 1;
        for (std::size_t c = 0; c < 3; ++c) {
            const double s = std::exp(
                std::clamp<double>(model.log_scale[3 * i + c], -LOG_SCALE_LIMIT, LOG_SCALE_LIMIT));
            const double wide = std::hypot(s, double{filter[i]});
            kept *= s / wide;
            baked.log_scale[3 * i + c] = static_cast<float>(std::log(wide));
        }
        const double opacity = kept / (1 + std::exp(-double{model.opacity_logit[i]}));
        baked.opacity_logit[i] = static_cast<float>(std::clamp(
            std::log(opacity / (1 - opacity)), -OPACITY_LOGIT_LIMIT, OPACITY_LOGIT_LIMIT));
    }
    return baked;
}

}  // namespace darb
