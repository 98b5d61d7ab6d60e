// SPDX-License-Identifier: MIT
#include "engine/raster/blend_backward.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/primitives/groups.h"
#include "engine/raster/forward.h"

namespace darb {

namespace {

constexpr std::uint64_t kPartialBytes = PARTIALS * sizeof(float);

std::uint64_t of_a_binding(const Device& device) {
    return device.info().max_storage_buffer_bytes / kPartialBytes / 8 * 8;  // windows: 256 bytes
}

// A subgroup of so many lanes for each block of the tile.
void add_pixel_constants(std::uint32_t lanes, SpecConstants& constants) {
    constants["SUBGROUP_SIZE"] = static_cast<std::int32_t>(lanes);
    constants["PIXELS"] = static_cast<std::int32_t>(64 / lanes);
    constants["THREADS"] = static_cast<std::int32_t>(4 * lanes);
}

}  // namespace

// Several bindings, but one buffer.
std::uint64_t BlendBackward::max_intersections(const Device& device) {
    return std::min(of_a_binding(device) * PARTIAL_WINDOWS,
                    device.info().max_allocation_bytes / kPartialBytes);
}

BlendBackward::BlendBackward(Device& device, const ForwardOptions& options)
    : device_(&device),
      options_(options),
      half_(blends_in_half(options)),
      method_(half_ ? BackwardBlend::pixels : device.tuning().backward),
      longest_first_(device.tuning().longest_first) {
    make_pipelines(false);
    make_buffers(device, *this, segment_buffers({}), "blend backward");
}

BufferList<BlendBackward> BlendBackward::intersection_buffers(std::uint64_t k, bool shaped,
                                                              bool depth_sum) {
    return {{&BlendBackward::partials_, "intersection partials", k * kPartialBytes},
            {&BlendBackward::rest_, "intersection partials, rest", k * (depth_sum ? 8 : 4)},
            {&BlendBackward::exponent_, "intersection partials, exponent", shaped ? k * 4 : 4}};
}

BufferList<BlendBackward> BlendBackward::segment_buffers(const FrameSize& size) {
    return {{&BlendBackward::behind_, "behind", size.list_segments > 1 ? size.pixels * 4 : 4}};
}

BufferList<BlendBackward> BlendBackward::bucket_buffers(std::uint64_t records) {
    return {{&BlendBackward::bucket_tile_, "bucket tile", records * 4},
            {&BlendBackward::bucket_rest_, "behind buckets", records * TILE_SIZE * TILE_SIZE * 4}};
}

FrameBytes BlendBackward::device_bytes(const FrameSize& size) {
    FrameBytes bytes;
    bytes.intersections =
        charged_bytes(intersection_buffers(size.intersections, size.shaped, size.depth_sum));
    bytes.images = charged_bytes(segment_buffers(size));
    if (const std::uint64_t records = size.checkpoint_records(); records > 0)
        bytes.intersections += charged_bytes(bucket_buffers(records));
    return bytes;
}

void BlendBackward::make_pipelines(bool segmented) {
    SpecConstants constants = kernel_constants(*device_, options_);
    const std::uint32_t subgroup = add_block_constants(*device_, constants);
    constants["THREADS"] = static_cast<std::int32_t>(subgroup);
    constants["ALPHA_GRADIENT"] = options_.alpha_gradient || options_.depth_sum ? 1 : 0;
    constants["LONGEST_FIRST"] = longest_first_ ? 1 : 0;
    constants["SEGMENT"] = segmented ? static_cast<std::int32_t>(LIST_SEGMENT) : 0;
    constants["BUCKET"] = static_cast<std::int32_t>(bucket_length(*device_));
    constants["WINDOW_INTERSECTIONS"] = static_cast<std::int32_t>(window_intersections_);
    constants = for_several_passes(std::move(constants));  // each method uses some of them
    segmented_ = segmented;
    if (half_) {
        make_half(std::move(constants));
        return;
    }
    if (is_by_pixels(method_)) {
        make_by_pixels(std::move(constants));
        return;
    }
    if (method_ == BackwardBlend::subgroup) {
        blend_ = Pipeline(*device_, "blend_backward", constants, true, subgroup);
        return;
    }
    if (method_ == BackwardBlend::team) {
        constants["THREADS"] = static_cast<std::int32_t>(4 * subgroup);  // a subgroup a block
        blend_ = Pipeline(*device_, "blend_backward_team", constants, true, subgroup);
        return;
    }
    if (!blend_) blend_ = Pipeline(*device_, "blend_backward_buckets", constants, true, subgroup);
    constants["THREADS"] = SPLAT_GROUP;
    if (!bucket_tiles_) bucket_tiles_ = Pipeline(*device_, "bucket_tiles", constants);
    bucket_behind_ = Pipeline(*device_, "bucket_behind", constants);
}

void BlendBackward::set_kernel(int kernel) {
    options_.kernel = kernel;
    half_ = blends_in_half(options_);
    method_ = half_ ? BackwardBlend::pixels : device_->tuning().backward;
    blend_ = {};
    make_pipelines(segmented_);
}

void BlendBackward::make_by_pixels(SpecConstants constants) {
    const std::uint32_t lanes = lanes_by_pixels(device_->info(), blend_subgroup(*device_));
    if (lanes == 0)
        throw Error(
            "backward blend",
            fmt::format("backward={} needs subgroups of 32 lanes or fewer and 32 KiB of "
                        "shared memory, which {} has not",
                        kBackwardBlends[static_cast<std::size_t>(method_)], device_->info().name),
            "Use --tune backward=team.");
    add_pixel_constants(lanes, constants);
    constants["BATCH"] = method_ == BackwardBlend::pixels4 ? 4 : 8;
    blend_ = Pipeline(*device_, "blend_backward_pixels", constants, true, lanes);
}

void BlendBackward::make_half(SpecConstants constants) {
    const std::uint32_t lanes = half_blend_lanes(*device_);
    add_pixel_constants(lanes, constants);
    constants["EVALUATION"] = EVALUATION_BUILTIN;
    constants["BATCH"] = 8;  // whatever the tuning, so that results depend on less
    blend_ = Pipeline(*device_, "blend_backward_half", constants, true, lanes);
}

// A size is taken note of once its buffers are there, as in FrameBuffers.
void BlendBackward::reserve(std::uint32_t intersections, std::uint32_t records) {
    if (records > 0 && bucket_tile_.bytes() < std::uint64_t{records} * 4)
        make_buffers(*device_, *this, bucket_buffers(records), "blend backward");
    if (intersections <= capacity_ && capacity_ > 0) return;
    capacity_ = 0;
    intersections = std::max(intersections, 1024u);
    make_buffers(
        *device_, *this,
        intersection_buffers(intersections, kernel_has_shape(options_.kernel), options_.depth_sum),
        "blend backward");
    capacity_ = intersections;
    const std::uint64_t most = of_a_binding(*device_);
    if (window_intersections_ > 0 || capacity_ <= most) return;
    window_intersections_ = static_cast<std::uint32_t>(most);
    make_pipelines(segmented_);
}

BufferRange BlendBackward::partials(std::uint32_t window) const {
    if (window_intersections_ == 0) return partials_;
    const std::uint64_t bytes = window_intersections_ * kPartialBytes;
    const std::uint64_t first = window * bytes < partials_.bytes() ? window * bytes : 0;
    return {partials_, first, std::min(bytes, partials_.bytes() - first)};
}

void BlendBackward::record(Commands& commands, const FrameView& view, const Frame& frame,
                           const Buffer& d_image) {
    const FrameSize& size = frame.size;
    if (size.intersections > capacity_)
        throw Error("backward blend",
                    fmt::format("{} intersections, buffers for {}", size.intersections, capacity_),
                    "Call reserve after each growth of the frame.");
    if (size.list_segments > 1 && !segmented_) make_pipelines(true);
    if (size.list_segments > 1 && behind_.bytes() < size.pixels * 4)
        make_buffers(*device_, *this, segment_buffers(size), "blend backward");
    if (!writes_every_slot(method_)) {
        commands.fill(partials_, 0);
        commands.fill(rest_, 0);
        if (kernel_has_shape(options_.kernel)) commands.fill(exponent_, 0);
    }
    const gpu::CameraData& camera = view.camera;
    const gpu::BlendArgs args{camera.width,
                              camera.height,
                              camera.tiles_x,
                              view.background.r,
                              view.background.g,
                              view.background.b,
                              0,
                              size.list_segments};
    if (method_ != BackwardBlend::buckets)
        record_lists(commands, frame, d_image, args);
    else
        record_buckets(commands, frame, d_image, args);
}

// Long lists take several dispatches, the last part of every list first.
void BlendBackward::record_lists(Commands& commands, const Frame& frame, const Buffer& d_image,
                                 gpu::BlendArgs args) {
    const ProjectedSplats& s = frame.splats;
    const TileIntersections& t = frame.intersections;
    const FrameImages& images = frame.images;
    const std::uint32_t tiles_y = (args.height + TILE_SIZE - 1) / TILE_SIZE;
    for (args.segment = args.segments; args.segment-- > 0;)
        commands.dispatch(blend_, args,
                          {t.tile_range, t.intersection_from_sorted, t.splat_from_intersection,
                           s.shape, s.light, s.bound, d_image, images.final_transmittance,
                           images.last_intersection, partials(0), partials(1), partials(2),
                           partials(3), partials(4), rest_, behind_, s.exponent, exponent_},
                          args.tiles_x, tiles_y);
}

void BlendBackward::record_buckets(Commands& commands, const Frame& frame, const Buffer& d_image,
                                   gpu::BlendArgs args) {
    const ProjectedSplats& s = frame.splats;
    const TileIntersections& t = frame.intersections;
    const FrameImages& images = frame.images;
    const std::uint32_t records = frame.checkpoint_records();
    if (records == 0)
        throw Error("backward blend", "the frame holds no checkpoints",
                    "Make it with store_for_backward, and with the device's tuning of now.");
    reserve(capacity_, records);
    const std::uint32_t tiles_y = (args.height + TILE_SIZE - 1) / TILE_SIZE;
    const gpu::BucketArgs buckets{args.width, args.height, args.tiles_x, records};
    commands.fill(bucket_tile_, 0);
    commands.dispatch(bucket_tiles_, buckets, {t.tile_range, bucket_tile_}, args.tiles_x, tiles_y);
    for (args.segment = args.segments; args.segment-- > 0;)
        commands.dispatch(bucket_behind_, args,
                          {t.tile_range, d_image, images.last_intersection, images.checkpoints,
                           behind_, bucket_rest_},
                          args.tiles_x, tiles_y, TILE_SIZE * TILE_SIZE / SPLAT_GROUP);
    const Groups g = groups_for(records, 1);
    commands.dispatch(blend_, buckets,
                      {t.tile_range, t.intersection_from_sorted, t.splat_from_intersection, s.shape,
                       s.light, s.bound, d_image, images.last_intersection, bucket_tile_,
                       images.checkpoints, bucket_rest_, partials_, rest_, s.exponent, exponent_},
                      g.x, g.y);
}

}  // namespace darb
