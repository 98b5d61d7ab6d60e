#include "engine/render/backward.h"

#include <algorithm>
#include <cmath>

#include "engine/core/check.h"
#include "engine/render/groups.h"

namespace darb {

AdamStep adam_step(const AdamStep& rates, int t) {
    const double correction1 = 1.0 - std::pow(0.9, t);
    const double correction2 = 1.0 - std::pow(0.999, t);
    const auto scaled = [&](float rate) { return static_cast<float>(rate / correction1); };
    return {scaled(rates.position),
            scaled(rates.scale),
            scaled(rates.rotation),
            scaled(rates.opacity),
            scaled(rates.sh_dc),
            scaled(rates.sh_rest),
            static_cast<float>(1.0 / std::sqrt(correction2))};
}

Backward::Backward(Device& device, const ForwardOptions& options, BackwardResult result)
    : device_(&device), options_(options), result_(result) {
    make_blend(false);
    make_buffers(device, *this, segment_buffers({}));
}

BufferList<Backward> Backward::splat_buffers(std::uint64_t splats) {
    return {{&Backward::gradient_sum_, "gradient sum", splats * 8}};
}

BufferList<Backward> Backward::pair_buffers(std::uint64_t pairs) {
    return {{&Backward::partials_, "pair partials", pairs * 32},
            {&Backward::partial_rest_, "pair partials, rest", pairs * 4}};
}

BufferList<Backward> Backward::segment_buffers(const FrameSize& size) {
    return {{&Backward::behind_, "behind", size.list_segments > 1 ? size.pixels * 4 : 4}};
}

FrameBytes Backward::device_bytes(const FrameSize& size) {
    return {charged_bytes(splat_buffers(size.splats)), charged_bytes(pair_buffers(size.pairs)),
            charged_bytes(segment_buffers(size))};
}

void Backward::make_blend(bool segmented) {
    SpecConstants blend = kernel_constants(options_);
    const std::uint32_t subgroup = add_block_constants(*device_, blend);
    blend["THREADS"] = static_cast<std::int32_t>(subgroup);
    blend["SEGMENT"] = segmented ? static_cast<std::int32_t>(LIST_SEGMENT) : 0;
    blend_ = Pipeline(*device_, "blend_backward", blend, true, subgroup);
    segmented_ = segmented;
}

void Backward::set_sh_stored(int degree) {
    if (degree != options_.sh_stored) project_.clear();
    options_.sh_stored = degree;
}

Pipeline& Backward::project_pipeline(int sh_degree) {
    const auto found = project_.find(sh_degree);
    if (found != project_.end()) return found->second;
    SpecConstants constants = kernel_constants(options_);
    constants["THREADS"] = SPLAT_GROUP;
    constants["SH_DEGREE"] = sh_degree;
    constants["SH_STORED"] = options_.sh_stored;
    add_constants(options_.effects, constants);
    constants["UPDATE"] = result_ == BackwardResult::update ? 1 : 0;
    return project_.emplace(sh_degree, Pipeline(*device_, "project_backward", constants))
        .first->second;
}

void Backward::reserve(std::uint32_t splats, std::uint32_t pairs) {
    if (splats > splat_capacity_ || splat_capacity_ == 0) {
        splat_capacity_ = std::max(splats, 1024u);
        make_buffers(*device_, *this, splat_buffers(splat_capacity_));
        gradient_sum_.upload(std::vector<float>(size_t{splat_capacity_} * 2, 0.0f));
    }
    if (pairs > pair_capacity_ || pair_capacity_ == 0) {
        pair_capacity_ = std::max(pairs, 1024u);
        make_buffers(*device_, *this, pair_buffers(pair_capacity_));
    }
}

// Long lists take several dispatches, the last part of every list first.
void Backward::record_blend(Commands& commands, const Forward& forward, const Buffer& d_image,
                            const gpu::CameraData& data, const glm::vec3& background) {
    const std::uint32_t segments = forward.list_segments();
    if (segments > 1 && !segmented_) make_blend(true);
    if (segments > 1 && behind_.bytes() < forward.size().pixels * 4)
        make_buffers(*device_, *this, segment_buffers(forward.size()));
    for (std::uint32_t segment = segments; segment-- > 0;) {
        const gpu::BlendArgs blend{data.width,   data.height,  data.tiles_x, background.r,
                                   background.g, background.b, segment,      segments};
        commands.dispatch(
            blend_, blend,
            {forward.tile_range(), forward.pair_order(), forward.pair_splat(),
             forward.splat_shape(), forward.splat_light(), forward.splat_bound(), d_image,
             forward.final_transmittance(), forward.last_pair(), partials_, partial_rest_, behind_},
            data.tiles_x, data.tiles_y);
    }
}

void Backward::record(Commands& commands, const Forward& forward, GpuSplats& splats,
                      const Buffer& d_image, const Buffer& cameras, std::uint32_t camera_index,
                      const gpu::CameraData& data, int sh_degree, const glm::vec3& background,
                      const AdamStep& step) {
    DARB_CHECK(splats.has_moments() && forward.options().store_for_backward, "set up for training");
    commands.pass("blend backward");
    commands.fill(partials_, 0);
    commands.fill(partial_rest_, 0);
    record_blend(commands, forward, d_image, data, background);

    if (splats.count() == 0) return;
    commands.pass("project backward");
    const auto n = static_cast<float>(splats.count());
    for (const SplatRange& range : splats.ranges()) {
        const gpu::ProjectBackwardArgs args{range.first,
                                            range.first + range.count,
                                            camera_index,
                                            static_cast<float>(LOW_PASS_DEFAULT),
                                            step.position,
                                            step.scale,
                                            step.rotation,
                                            step.opacity,
                                            step.sh_dc,
                                            step.sh_rest,
                                            step.inverse_sqrt_correction2,
                                            step.opacity_weight / n,
                                            step.scale_weight / (3.0f * n)};
        const Groups g = groups_for(range.count);
        commands.dispatch(project_pipeline(sh_degree), args,
                          {cameras,
                           splats.parameters(kPosition),
                           splats.parameters(kLogScale),
                           splats.parameters(kRotation),
                           splats.parameters(kOpacity),
                           splats.parameters(kShDc),
                           splats.rows(splats.parameters(kShRest), range),
                           splats.moments(kPosition),
                           splats.moments(kLogScale),
                           splats.moments(kRotation),
                           splats.moments(kOpacity),
                           splats.moments(kShDc),
                           splats.rows(splats.moments(kShRest), range),
                           forward.pair_count(),
                           forward.pair_begin(),
                           partials_,
                           partial_rest_,
                           gradient_sum_,
                           forward.status(),
                           splats.smoothing()},
                          g.x, g.y);
    }
}

}  // namespace darb
