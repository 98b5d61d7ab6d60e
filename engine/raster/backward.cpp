// SPDX-License-Identifier: MIT
#include "engine/raster/backward.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "engine/core/error.h"
#include "engine/primitives/groups.h"

namespace darb {

namespace {
void check_stored(const ForwardOptions& options) {
    if (!options.store_for_backward)
        throw Error("backward pass", "the frame keeps nothing to walk back from",
                    "Make both with store_for_backward.");
}
}  // namespace

Backward::Backward(Device& device, const ForwardOptions& options)
    : device_(&device),
      options_(options),
      blend_(device, options),
      sums_by_chunks_(device.tuning().sums_by_chunks) {}

BufferList<Backward> Backward::splat_buffers(std::uint64_t splats) {
    return {{&Backward::gradient_sum_, "gradient sum", splats * 8}};
}

FrameBytes Backward::device_bytes(const FrameSize& size) {
    FrameBytes bytes = BlendBackward::device_bytes(size);
    bytes.splats += charged_bytes(splat_buffers(size.splats));
    return bytes;
}

Pipeline& Backward::project_pipeline(int sh_degree, int sh_stored, int update, int rest,
                                     bool flatness) {
    const std::array<int, 5> key{sh_degree, sh_stored, update, rest, flatness ? 1 : 0};
    const auto found = project_.find(key);
    if (found != project_.end()) return found->second;
    SpecConstants constants = projection_constants(*device_, options_, sh_degree, sh_stored);
    constants["WINDOW_INTERSECTIONS"] = static_cast<std::int32_t>(blend_.window_intersections());
    constants["CAMERA_GRADIENT"] = options_.camera_gradient && update == UPDATE_STORE ? 1 : 0;
    constants["SUMS_BY_CHUNKS"] = sums_by_chunks_ ? 1 : 0;
    constants["UPDATE"] = update;
    constants["REST"] = rest;
    constants["FLATNESS"] = flatness ? 1 : 0;
    return project_.emplace(key, Pipeline(*device_, "project_backward", constants)).first->second;
}

void Backward::set_kernel(int kernel) {
    options_.kernel = kernel;
    blend_.set_kernel(kernel);
    project_.clear();
    chunks_ = {};
}

void Backward::reserve(std::uint32_t splats, std::uint32_t intersections, std::uint32_t records) {
    if (splats > splat_capacity_ || splat_capacity_ == 0) {
        splat_capacity_ = 0;
        splats = std::max(splats, 1024u);
        make_buffers(*device_, *this, splat_buffers(splats), "project backward");
        splat_capacity_ = splats;
        gradient_sum_.upload(std::vector<float>(size_t{splat_capacity_} * 2, 0.0f));
    }
    const std::uint32_t window_intersections = blend_.window_intersections();
    blend_.reserve(intersections, records);
    if (blend_.window_intersections() == window_intersections) return;
    project_.clear();
    chunks_ = {};
}

void Backward::record_chunks(Commands& commands, const Frame& frame) {
    if (!sums_by_chunks_) return;
    if (!chunks_) {
        SpecConstants constants = kernel_constants(*device_, options_);
        constants["WINDOW_INTERSECTIONS"] =
            static_cast<std::int32_t>(blend_.window_intersections());
        chunks_ = Pipeline(*device_, "partial_chunks", constants);
    }
    const FrameCounters& c = frame.counters;
    const ProjectedSplats& s = frame.splats;
    commands.dispatch_indirect(
        chunks_, NoArgs{},
        {c.status, c.intersections_in_use, frame.intersections.splat_from_intersection,
         s.intersection_count, s.first_intersection, blend_.partials(0), blend_.partials(1),
         blend_.partials(2), blend_.partials(3), blend_.partials(4), blend_.rest(),
         blend_.exponent()},
        c.groups, offsetof(gpu::FrameGroups, intersections_x));
}

void Backward::record_project(Commands& commands, const FrameView& view, const Frame& frame,
                              const GpuSplats& splats, Pipeline& pipeline,
                              const gpu::ProjectBackwardArgs& args, const ProjectBuffers& extra) {
    const SplatRange range{args.first_splat, args.splat_end - args.first_splat};
    std::vector<BufferRange> buffers{*view.cameras};
    splats.bind_parameters(range, buffers);
    buffers.insert(buffers.end(), extra.state.begin(), extra.state.end());
    buffers.insert(buffers.end(),
                   {frame.splats.intersection_count, frame.splats.first_intersection});
    for (std::uint32_t w = 0; w < PARTIAL_WINDOWS; ++w) buffers.push_back(blend_.partials(w));
    buffers.insert(buffers.end(), {blend_.rest(), extra.sums, frame.counters.status,
                                   splats.smoothing(), extra.rest_sum, blend_.exponent()});
    const Groups g = groups_for(range.count);
    commands.dispatch(pipeline, args, buffers, g.x, g.y);
}

void Backward::record(Commands& commands, const FrameView& view, const Frame& frame,
                      GpuSplats& splats, const Buffer& d_image, const AdamStep& step) {
    check_stored(options_);
    check_trainable(splats, step);
    if (options_.linear_values || options_.direct_colour)
        throw Error("backward pass", "a step of Adam is made of logits, logarithms and harmonics",
                    "Leave linear_values and direct_colour off, or take record_gradients.");
    if (step.beta1 != 0.9 || step.beta2 != 0.999 || step.rest_beta1 != 0.9 ||
        step.rest_beta2 != 0.999)
        throw Error("backward pass", fmt::format("betas {} and {}", step.beta1, step.beta2),
                    "Take AdamUpdate for others than 0.9 and 0.999.");
    commands.pass("blend backward");
    blend_.record(commands, view, frame, d_image);

    if (splats.count() == 0) return;
    commands.pass("project backward");
    record_chunks(commands, frame);
    const auto n = static_cast<float>(splats.count() + step.splats_gone);
    gpu::ProjectBackwardArgs args{};
    args.camera_index = view.index;
    args.low_pass = static_cast<float>(LOW_PASS_DEFAULT);
    std::copy(step.rate.begin(), step.rate.end(), args.rate);
    args.inverse_sqrt_correction2 = step.inverse_sqrt_correction2;
    args.opacity_weight = step.opacity_weight / n;
    args.scale_weight = step.scale_weight / (3.0f * n);
    args.flatness_weight = step.flatness_weight / n;
    args.regularise_unseen = step.regularise_unseen > 0 ? 1u : 0u;
    args.largest_log_scale = step.largest_log_scale;
    args.clearance = step.clearance;
    args.rest_share = 1.0f / static_cast<float>(step.rest_every);
    const int rest = view.sh_degree > 0 ? step.rest : REST_EACH;  // nothing to step at degree 0
    Pipeline& pipeline = project_pipeline(view.sh_degree, splats.sh_degree(), UPDATE_ADAM, rest,
                                          step.flatness_weight > 0);
    for (const SplatRange& range : splats.trained_ranges()) {
        args.first_splat = range.first;
        args.splat_end = range.first + range.count;
        ProjectBuffers extra{{}, gradient_sum_, splats.rest_sum(range)};
        splats.bind_moments(range, extra.state);
        record_project(commands, view, frame, splats, pipeline, args, extra);
    }
}

void Backward::record_gradients(Commands& commands, const FrameView& view, const Frame& frame,
                                const GpuSplats& splats, const Buffer& d_image,
                                const GradientTarget& target) {
    const auto& [to, add, camera] = target;
    check_stored(options_);
    if (options_.camera_gradient && (!camera || add))
        throw Error("backward pass", "no gradient of this camera can be left",
                    "Give a buffer for it, and add views up on the host.");
    if (to.count() != splats.count())
        throw Error("backward pass",
                    fmt::format("{} splats, gradients of {}", splats.count(), to.count()),
                    "Make the gradients' buffers anew where splats come or go.");
    commands.pass("blend backward");
    blend_.record(commands, view, frame, d_image);

    if (splats.count() == 0) return;
    commands.pass("project backward");
    record_chunks(commands, frame);
    gpu::ProjectBackwardArgs args{};
    args.camera_index = view.index;
    args.low_pass = static_cast<float>(LOW_PASS_DEFAULT);
    Pipeline& pipeline = project_pipeline(view.sh_degree, splats.sh_degree(),
                                          add ? UPDATE_ADD : UPDATE_STORE, REST_EACH, false);
    for (const SplatRange& range : splats.ranges()) {
        args.first_splat = range.first;
        args.splat_end = range.first + range.count;
        // The camera's buffer is bound in place of a sum of harmonics, which is not touched.
        const BufferRange rest =
            camera ? BufferRange(*camera) : bound_rows(to.of(kShRest), to.rows(kShRest), range);
        ProjectBuffers extra{{}, to.views(), rest};
        to.bind(range, extra.state);
        record_project(commands, view, frame, splats, pipeline, args, extra);
    }
}

}  // namespace darb
