// SPDX-License-Identifier: MIT
#include "engine/raster/forward.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <utility>

#include "engine/core/error.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/primitives/groups.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/kernel_constants.h"

namespace darb {

namespace {

constexpr std::uint32_t kBlocks = TILE_SIZE * TILE_SIZE / 64;

int bits_for(std::uint32_t count) {
    return std::max(1, static_cast<int>(std::bit_width(count > 0 ? count - 1 : 0)));
}

}  // namespace

bool is_exponential(int kernel) {
    if (blend_parts(kernel)) return false;
    const int form = kernel_profile(kernel).form;
    return form == KERNEL_FORM_GAUSSIAN || form == KERNEL_FORM_EXPONENTIAL;
}

bool has_half_blend(int kernel) {
    if (blend_parts(kernel)) return false;
    const int form = kernel_profile(kernel).form;
    return form == KERNEL_FORM_GAUSSIAN || form == KERNEL_FORM_GES;
}

bool blends_in_half(const ForwardOptions& options) {
    return options.arithmetic == ARITHMETIC_FAST16 && has_half_blend(options.kernel) &&
           options.depth_order != DEPTH_ORDER_PIXEL;
}

std::uint32_t half_blend_lanes(const Device& device) {
    const std::uint32_t lanes = lanes_by_pixels(device.info(), blend_subgroup(device));
    if (lanes == 0)
        throw Error("arithmetic fast16",
                    fmt::format("it needs subgroups of 32 lanes or fewer and 32 KiB of shared "
                                "memory, which {} has not",
                                device.info().name),
                    "Use --arithmetic float32, or choose another device (darb devices).");
    if (!device.info().half_arithmetic)
        throw Error("arithmetic fast16",
                    fmt::format("{} has no arithmetic in half precision (shaderFloat16)",
                                device.info().name),
                    "Use --arithmetic float32, or choose another device (darb devices).");
    return lanes;
}

int evaluation_on(const Device& device, const ForwardOptions& options) {
    if (options.evaluation != kEvaluationOfDevice) return options.evaluation;
    const bool builtin = device.tuning().exp_builtin && is_exponential(options.kernel);
    return builtin ? EVALUATION_BUILTIN : EVALUATION_POLYNOMIAL;
}

SpecConstants kernel_constants(const Device& device, const ForwardOptions& options) {
    SpecConstants constants =
        kernel_constants(options.kernel, options.footprint, evaluation_on(device, options),
                         options.polynomial_degree, options.alpha_cutoff);
    constants["STORAGE"] = options.storage;
    constants["DEPTH_ORDER"] = options.depth_order;
    constants["LINEAR_VALUES"] = options.linear_values ? 1 : 0;
    constants["DIRECT_COLOUR"] = options.direct_colour ? 1 : 0;
    constants["DEPTH_SUM"] = options.depth_sum ? 1 : 0;
    constants["DEPTH_SPREAD"] = options.depth_spread ? 1 : 0;
    return for_several_passes(std::move(constants));
}

SpecConstants projection_constants(const Device& device, const ForwardOptions& options,
                                   int sh_degree, int sh_stored) {
    SpecConstants constants = kernel_constants(device, options);
    constants["THREADS"] = SPLAT_GROUP;
    constants["SH_DEGREE"] = sh_degree;
    constants["SH_STORED"] = sh_stored;
    constants["PROJECTION"] = options.projection;
    add_constants(options.effects, constants);
    return constants;
}

std::uint32_t blend_subgroup(const Device& device) {
    const std::uint32_t chosen = device.tuning().blend_lanes;
    return chosen != 0 ? chosen : std::clamp(device.info().subgroup_size, 4u, 64u);
}

std::uint32_t bucket_length(const Device& device) {
    return std::max(BUCKET_INTERSECTIONS, blend_subgroup(device));
}

std::uint32_t add_block_constants(const Device& device, SpecConstants& constants) {
    const std::uint32_t subgroup = blend_subgroup(device);
    constants["SUBGROUP_SIZE"] = static_cast<std::int32_t>(subgroup);
    constants["PIXELS"] = static_cast<std::int32_t>(64 / subgroup);
    constants["LOCKSTEP"] = device.info().type == "cpu" ? 1 : 0;
    return subgroup;
}

Forward::Forward(Device& device, const ForwardOptions& options)
    : device_(&device),
      options_(options),
      short_depths_(device.tuning().short_depths && options.depth_order != DEPTH_ORDER_CENTRE16),
      emits_slots_(device.tuning().emit_by_slots),
      longest_first_(device.tuning().longest_first),
      records_(device.tuning().blend_records),
      half_(blends_in_half(options)),
      blend_threads_(
          std::max(records_ ? kBlocks * blend_subgroup(device) : device.tuning().blend_threads,
                   blend_subgroup(device))) {
    if (half_) half_blend_lanes(device);  // throws where there are none
    if (options.store_for_backward && options.depth_order == DEPTH_ORDER_PIXEL)
        throw Error("frame", "a resorted pixel cannot be walked back",
                    "Use another depth order, or do not store for a backward pass.");
    const SpecConstants per_item{{"THREADS", SPLAT_GROUP}};
    SpecConstants of_splat = kernel_constants(device, options);
    of_splat["THREADS"] = SPLAT_GROUP;
    compact_ = Pipeline(device, "compact", of_splat);
    if (short_depths_) {
        SpecConstants of_keys = of_splat;
        of_keys["SHORT_KEYS"] = 1;
        compact_short_.emplace(device, "compact", of_keys);
    }
    gather_counts_ = Pipeline(device, "gather_counts", per_item);
    groups_visible_ = Pipeline(device, "frame_groups", {{"THREADS", 1}, {"STAGE", 0}}, false);
    groups_intersections_ = Pipeline(device, "frame_groups", {{"THREADS", 1}, {"STAGE", 1}}, false);
    tile_ranges_ = Pipeline(device, "tile_ranges", per_item);
    list_lengths_ = Pipeline(device, "list_lengths", per_item);
    if (longest_first_) tile_order_ = Pipeline(device, "tile_order");
    emit_ = Pipeline(device, emits_slots_ ? "emit_slots" : "emit", of_splat);
}

// What names no kernel is shared with what there was, as pipelines with equal constants are one.
void Forward::set_kernel(int kernel) {
    DARB_CHECK(kernel_has_shape(kernel) == kernel_has_shape(options_.kernel), "kernel {}", kernel);
    ForwardOptions options = options_;
    options.kernel = kernel;
    *this = Forward(*device_, options);
}

Pipeline& Forward::project_pipeline(int sh_degree, int sh_stored) {
    const auto found = project_.find({sh_degree, sh_stored});
    if (found != project_.end()) return found->second;
    return project_
        .emplace(std::pair(sh_degree, sh_stored),
                 Pipeline(*device_, "project",
                          projection_constants(*device_, options_, sh_degree, sh_stored), false,
                          kAnySubgroupSize))
        .first->second;
}

// Parts of lists take a pipeline of their own, as whole ones need not keep the pixels' state.
Pipeline& Forward::blend_pipeline(const Frame& frame) {
    const bool parts = frame.size.list_segments > 1;
    Pipeline& pipeline = blend_[parts ? 1 : 0];
    if (pipeline) return pipeline;
    SpecConstants blend = kernel_constants(*device_, options_);
    blend["MIN_TRANSMITTANCE"] = least_transmittance(options_.transmittance_stop);
    blend["STORE_FOR_BACKWARD"] = options_.store_for_backward ? 1 : 0;
    std::uint32_t subgroup = add_block_constants(*device_, blend);
    if (half_) {
        subgroup = half_blend_lanes(*device_);
        blend["SUBGROUP_SIZE"] = static_cast<std::int32_t>(subgroup);
        blend["EVALUATION"] = EVALUATION_BUILTIN;
    }
    const std::uint32_t threads = half_ ? kBlocks * subgroup : blend_threads_;
    blend["THREADS"] = static_cast<std::int32_t>(threads);
    blend["PIXELS"] = static_cast<std::int32_t>(TILE_SIZE * TILE_SIZE / threads);
    blend["CHECKPOINTS"] = frame.size.bucket > 0 ? 1 : 0;
    if (frame.size.bucket > 0) blend["BUCKET"] = static_cast<std::int32_t>(frame.size.bucket);
    blend["LONGEST_FIRST"] = longest_first_ ? 1 : 0;
    blend["SEGMENT"] = parts ? static_cast<std::int32_t>(LIST_SEGMENT) : 0;
    const char* shader = half_ ? "blend_half" : blends_records(frame) ? "blend_records" : "blend";
    pipeline = Pipeline(*device_, shader, blend, true, subgroup);
    return pipeline;
}

bool Forward::blends_records(const Frame& frame) const {
    return records_ && options_.depth_order != DEPTH_ORDER_PIXEL && frame.size.bucket == 0;
}

void Forward::make_huge_pipelines() {
    if (emit_huge_) return;
    SpecConstants constants = kernel_constants(*device_, options_);
    constants["THREADS"] = SPLAT_GROUP;
    constants["COOPERATE"] = 1;
    emit_others_.emplace(*device_, "emit", constants);
    emit_huge_.emplace(*device_, "emit_huge", kernel_constants(*device_, options_));
}

void Forward::record(Commands& commands, const GpuSplats& splats, const FrameView& view,
                     Frame& frame) {
    record_intersections(commands, splats, view, frame);
    record_blend(commands, view, frame);
}

void Forward::record_intersections(Commands& commands, const GpuSplats& splats,
                                   const FrameView& view, Frame& frame) {
    const gpu::CameraData& camera = view.camera;
    const std::uint32_t n = splats.count();
    if (n > frame.size.splats || std::uint64_t(camera.width) * camera.height > frame.size.pixels)
        throw Error("frame",
                    fmt::format("{} splats at {} x {} px, buffers for {} and {} px", n,
                                camera.width, camera.height, frame.size.splats, frame.size.pixels),
                    "Call FrameBuffers::reserve for them first.");
    if (n > 0 && kernel_has_shape(options_.kernel) && splats.stride(kShape) == 0)
        throw Error("frame",
                    fmt::format("the kernel {} takes a shape of each splat, these have none",
                                kernel_name(options_.kernel)),
                    "Call set_kernel on the splats, which gives them one.");
    const gpu::IntersectionArgs args{frame.size.intersections, camera.tiles_x,
                                     camera.tiles_x * camera.tiles_y,
                                     frame.size.list_segments * LIST_SEGMENT};
    record_projection(commands, splats, view, frame);
    record_depth_order(commands, n, camera.near_plane, frame);
    record_emission(commands, n, args, frame);
    record_tiles(commands, args, frame);
}

void Forward::record_projection(Commands& commands, const GpuSplats& splats, const FrameView& view,
                                const Frame& frame) {
    commands.pass("project");
    constexpr std::uint64_t of_frame = offsetof(gpu::FrameStatus, bad_gradients);
    const Buffer& status = frame.counters.status;
    commands.fill(BufferRange(status, of_frame, sizeof(gpu::FrameStatus) - of_frame), 0);
    commands.fill(frame.counters.splats, splats.count());
    const ProjectedSplats& out = frame.splats;
    for (const SplatRange& range : splats.ranges()) {
        const gpu::ProjectArgs args{range.first, range.first + range.count, view.index,
                                    static_cast<float>(LOW_PASS_DEFAULT)};
        const Groups g = groups_for(range.count);
        std::vector<BufferRange> buffers{*view.cameras};
        splats.bind_parameters(range, buffers);
        buffers.insert(buffers.end(),
                       {out.shape, out.light, out.bound, out.cover, out.intersection_count,
                        out.visible, status, splats.smoothing(), out.exponent});
        commands.dispatch(project_pipeline(view.sh_degree, splats.sh_degree()), args, buffers, g.x,
                          g.y);
    }
}

void Forward::record_depth_order(Commands& commands, std::uint32_t n, float near_plane,
                                 Frame& frame) {
    const FrameCounters& c = frame.counters;
    const ProjectedSplats& s = frame.splats;
    const Groups g = groups_for(n);
    commands.pass("compact");
    frame.sorts.scan->record(commands, s.visible, s.visible_offset, c.splats, 0, c.visible);
    commands.dispatch(groups_visible_, gpu::IntersectionArgs{frame.size.intersections, 0, 0, 0},
                      {c.status, c.groups, c.visible, c.visible_in_use}, 1);
    const RadixSort& sort = *frame.sorts.by_depth;
    // A sort of an odd number of digits takes its pairs in its scratch buffers.
    const bool in_scratch = short_depths_ && !frame.size.deep && sort.is_odd(SHORT_DEPTH_BITS);
    const gpu::CompactArgs args{n, near_plane};
    if (in_scratch) {
        commands.dispatch(*compact_short_, args,
                          {s.visible, s.visible_offset, s.bound, sort.scratch_keys(),
                           sort.scratch_values(), c.status},
                          g.x, g.y);
        commands.pass("depth sort");
        frame.sorts.by_depth->record_from_scratch(commands, s.depth_key, s.splat_from_depth,
                                                  c.visible_in_use, 0, SHORT_DEPTH_BITS);
        return;
    }
    commands.dispatch(compact_, args,
                      {s.visible, s.visible_offset, s.bound, s.depth_key, s.splat_from_depth,
                       frame.intersections.no_huge_rank},  // in place of the status: no barrier
                      g.x, g.y);
    commands.pass("depth sort");
    const int key_bits = options_.depth_order == DEPTH_ORDER_CENTRE16 ? DEPTH_KEY_BITS : 32;
    frame.sorts.by_depth->record(commands, s.depth_key, s.splat_from_depth, c.visible_in_use, 0,
                                 key_bits);
}

void Forward::record_emission(Commands& commands, std::uint32_t n,
                              const gpu::IntersectionArgs& args, Frame& frame) {
    const FrameCounters& c = frame.counters;
    const ProjectedSplats& s = frame.splats;
    const TileIntersections& out = frame.intersections;
    const bool huge = frame.cooperates && !emits_slots_;
    if (huge) make_huge_pipelines();
    constexpr std::uint64_t of_visible = offsetof(gpu::FrameGroups, visible_x);
    commands.pass("emit");
    commands.dispatch_indirect(
        gather_counts_, gpu::SplatArgs{n},
        {c.status, s.splat_from_depth, s.intersection_count, s.count_by_depth}, c.groups,
        of_visible);
    frame.sorts.scan->record(commands, s.count_by_depth, s.offset_by_depth, c.visible_in_use, 0,
                             c.intersections);
    commands.dispatch(groups_intersections_, args,
                      {c.status, c.groups, c.intersections, c.intersections_in_use}, 1);
    if (emits_slots_) {
        record_slots(commands, args, frame);
        return;
    }
    commands.dispatch_indirect(huge ? *emit_others_ : emit_, args,
                               {c.status, s.splat_from_depth, s.offset_by_depth, s.cover, out.tile,
                                out.splat_from_intersection, s.first_intersection, s.shape, s.bound,
                                huge ? out.huge_rank : out.no_huge_rank},
                               c.groups, of_visible);
    if (huge)
        commands.dispatch(*emit_huge_, args,
                          {c.status, s.splat_from_depth, s.offset_by_depth, s.cover, out.tile,
                           out.splat_from_intersection, out.huge_rank, s.shape, s.bound},
                          EMIT_HUGE_GROUPS);
}

// Huge splats are no slower there than others.
void Forward::record_slots(Commands& commands, const gpu::IntersectionArgs& args, Frame& frame) {
    const FrameCounters& c = frame.counters;
    const ProjectedSplats& s = frame.splats;
    const TileIntersections& out = frame.intersections;
    commands.dispatch_indirect(emit_, args,
                               {c.status, s.splat_from_depth, s.offset_by_depth, s.cover, out.tile,
                                out.splat_from_intersection, s.first_intersection, s.shape, s.bound,
                                c.intersections_in_use},
                               c.groups, offsetof(gpu::FrameGroups, intersections_x));
}

void Forward::record_tiles(Commands& commands, const gpu::IntersectionArgs& args, Frame& frame) {
    const FrameCounters& c = frame.counters;
    const TileIntersections& t = frame.intersections;
    commands.pass("tile sort");
    if (frame.sorts.lists) {
        frame.sorts.lists->record(
            commands,
            {c.intersections_in_use, t.tile, t.intersection_from_sorted, t.tile_range, c.status},
            args.tile_count, args.list_capacity);
        if (longest_first_) commands.dispatch(tile_order_, args, {t.tile_range}, 1);
        return;
    }
    commands.fill(t.tile_range, 0);  // beside the sort
    frame.sorts.by_tile->record(commands, t.tile, t.intersection_from_sorted,
                                c.intersections_in_use, 0, bits_for(args.tile_count), true);
    commands.pass("tile ranges");
    commands.dispatch_indirect(tile_ranges_, args, {c.intersections_in_use, t.tile, t.tile_range},
                               c.groups, offsetof(gpu::FrameGroups, intersections_x));
    const Groups g = groups_for(args.tile_count);
    commands.dispatch(list_lengths_, args, {c.status, t.tile_range}, g.x, g.y);
    if (longest_first_) commands.dispatch(tile_order_, args, {t.tile_range}, 1);
}

void Forward::record_blend(Commands& commands, const FrameView& view, Frame& frame) {
    const gpu::CameraData& camera = view.camera;
    const ProjectedSplats& s = frame.splats;
    const TileIntersections& t = frame.intersections;
    const FrameImages& out = frame.images;
    Pipeline& pipeline = blend_pipeline(frame);
    commands.pass("blend");
    for (std::uint32_t segment = 0; segment < frame.size.list_segments; ++segment) {
        const gpu::BlendArgs blend{camera.width,      camera.height,           camera.tiles_x,
                                   view.background.r, view.background.g,       view.background.b,
                                   segment,           frame.size.list_segments};
        commands.dispatch(pipeline, blend,
                          {t.tile_range, t.intersection_from_sorted, t.splat_from_intersection,
                           s.shape, s.light, s.bound, out.image, out.final_transmittance,
                           out.last_intersection, out.checkpoints, s.exponent},
                          camera.tiles_x, camera.tiles_y);
    }
}

void Forward::record_depth(Commands& commands, std::uint32_t splats, const FrameView& view,
                           Frame& frame) {
    if (options_.storage != STORAGE_FLOAT32)
        throw Error("depth image", "16-bit storage does not hold depths",
                    "Render it with storage float32.");
    if (!depth_light_)
        depth_light_.emplace(*device_, "depth_light", SpecConstants{{"THREADS", SPLAT_GROUP}});
    commands.pass("depth");
    if (splats > 0) {
        const Groups g = groups_for(splats);
        commands.dispatch(*depth_light_, gpu::SplatArgs{splats},
                          {frame.splats.bound, frame.splats.light}, g.x, g.y);
    }
    FrameView black = view;
    black.background = glm::vec3(0.0f);
    record_blend(commands, black, frame);
}

}  // namespace darb
