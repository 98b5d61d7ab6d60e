#include "engine/raster/backward.h"

#include <algorithm>
#include <cmath>

#include "engine/core/check.h"
#include "engine/primitives/groups.h"

namespace darb {

AdamStep adam_step(const AdamStep& rates, int t) {
    const auto correction1 = [](int steps) { return 1.0 - std::pow(0.9, steps); };
    const auto correction2 = [](int steps) { return std::sqrt(1.0 - std::pow(0.999, steps)); };
    const auto scaled = [&](float rate) { return static_cast<float>(rate / correction1(t)); };
    AdamStep step = rates;
    step.position = scaled(rates.position);
    step.scale = scaled(rates.scale);
    step.rotation = scaled(rates.rotation);
    step.opacity = scaled(rates.opacity);
    step.sh_dc = scaled(rates.sh_dc);
    step.sh_rest = scaled(rates.sh_rest);
    step.inverse_sqrt_correction2 = static_cast<float>(1.0 / correction2(t));
    if (rates.rest_every > 1) {
        step.rest = t % rates.rest_every == 0 ? REST_APPLY : REST_GATHER;
        const int steps = std::max(t / rates.rest_every, 1);
        step.sh_rest = static_cast<float>(rates.sh_rest / correction1(steps) * correction2(steps) /
                                          correction2(t));
    }
    return step;
}

Backward::Backward(Device& device, const ForwardOptions& options, BackwardResult result)
    : device_(&device), options_(options), result_(result), blend_(device, options) {}

BufferList<Backward> Backward::splat_buffers(std::uint64_t splats) {
    return {{&Backward::gradient_sum_, "gradient sum", splats * 8}};
}

FrameBytes Backward::device_bytes(const FrameSize& size) {
    FrameBytes bytes = BlendBackward::device_bytes(size);
    bytes.splats += charged_bytes(splat_buffers(size.splats));
    return bytes;
}

Pipeline& Backward::project_pipeline(int sh_degree, int sh_stored, int rest) {
    const std::array<int, 3> key{sh_degree, sh_stored, rest};
    const auto found = project_.find(key);
    if (found != project_.end()) return found->second;
    SpecConstants constants = kernel_constants(options_);
    constants["THREADS"] = SPLAT_GROUP;
    constants["SH_DEGREE"] = sh_degree;
    constants["SH_STORED"] = sh_stored;
    add_constants(options_.effects, constants);
    constants["WINDOW_PAIRS"] = static_cast<std::int32_t>(blend_.window_pairs());
    constants["UPDATE"] = result_ == BackwardResult::update ? 1 : 0;
    constants["REST"] = rest;
    return project_.emplace(key, Pipeline(*device_, "project_backward", constants)).first->second;
}

void Backward::reserve(std::uint32_t splats, std::uint32_t intersections, std::uint32_t records) {
    if (splats > splat_capacity_ || splat_capacity_ == 0) {
        splat_capacity_ = 0;
        splats = std::max(splats, 1024u);
        make_buffers(*device_, *this, splat_buffers(splats), "project backward");
        splat_capacity_ = splats;
        gradient_sum_.upload(std::vector<float>(size_t{splat_capacity_} * 2, 0.0f));
    }
    const std::uint32_t window_pairs = blend_.window_pairs();
    blend_.reserve(intersections, records);
    if (blend_.window_pairs() != window_pairs) project_.clear();
}

void Backward::record_shares(Commands& commands, const FrameView& view, const Frame& frame,
                             const Buffer& image) {
    FrameView black = view;
    black.background = glm::vec3(0);
    blend_.record(commands, black, frame, image);
}

void Backward::record(Commands& commands, const FrameView& view, const Frame& frame,
                      GpuSplats& splats, const Buffer& d_image, const AdamStep& step) {
    DARB_CHECK(splats.has_moments() && options_.store_for_backward, "set up for training");
    DARB_CHECK(step.rest == REST_EACH || splats.has_rest_sum(), "nothing to gather in");
    commands.pass("blend backward");
    blend_.record(commands, view, frame, d_image);

    if (splats.count() == 0) return;
    commands.pass("project backward");
    const auto n = static_cast<float>(splats.count());
    for (const SplatRange& range : splats.ranges()) {
        const gpu::ProjectBackwardArgs args{range.first,
                                            range.first + range.count,
                                            view.index,
                                            static_cast<float>(LOW_PASS_DEFAULT),
                                            step.position,
                                            step.scale,
                                            step.rotation,
                                            step.opacity,
                                            step.sh_dc,
                                            step.sh_rest,
                                            step.inverse_sqrt_correction2,
                                            step.opacity_weight / n,
                                            step.scale_weight / (3.0f * n),
                                            step.regularise_unseen ? 1u : 0u,
                                            step.largest_log_scale,
                                            step.clearance,
                                            1.0f / static_cast<float>(step.rest_every)};
        const Groups g = groups_for(range.count);
        const int rest = view.sh_degree > 0 ? step.rest : REST_EACH;  // nothing to step at degree 0
        commands.dispatch(project_pipeline(view.sh_degree, splats.sh_degree(), rest), args,
                          {*view.cameras,
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
                           frame.splats.intersection_count,
                           frame.splats.first_intersection,
                           blend_.partials(0),
                           blend_.partials(1),
                           blend_.partials(2),
                           blend_.partials(3),
                           blend_.partials(4),
                           blend_.rest(),
                           gradient_sum_,
                           frame.counters.status,
                           splats.smoothing(),
                           splats.rows(splats.rest_sum(), range)},
                          g.x, g.y);
    }
}

}  // namespace darb
