#include "engine/raster/blend_backward.h"

#include <algorithm>

#include "engine/core/check.h"
#include "engine/primitives/groups.h"

namespace darb {

namespace {

constexpr std::uint64_t kPartialBytes = PARTIALS * sizeof(float);

std::uint64_t pairs_of_a_binding(const Device& device) {
    return device.info().max_storage_buffer_bytes / kPartialBytes / 8 * 8;  // windows: 256 bytes
}

}  // namespace

// Several bindings, but one buffer.
std::uint64_t BlendBackward::max_pairs(const Device& device) {
    return std::min(pairs_of_a_binding(device) * PARTIAL_WINDOWS,
                    device.info().max_allocation_bytes / kPartialBytes);
}

BlendBackward::BlendBackward(Device& device, const ForwardOptions& options)
    : device_(&device), options_(options), way_(tuning_of(device).backward) {
    make_pipelines(false);
    make_buffers(device, *this, segment_buffers({}), "blend backward");
}

BufferList<BlendBackward> BlendBackward::pair_buffers(std::uint64_t pairs) {
    return {{&BlendBackward::partials_, "pair partials", pairs * kPartialBytes},
            {&BlendBackward::rest_, "pair partials, rest", pairs * 4}};
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
    bytes.pairs = charged_bytes(pair_buffers(size.pairs));
    bytes.images = charged_bytes(segment_buffers(size));
    if (const std::uint64_t records = size.checkpoint_records(); records > 0)
        bytes.pairs += charged_bytes(bucket_buffers(records));
    return bytes;
}

void BlendBackward::make_pipelines(bool segmented) {
    SpecConstants constants = kernel_constants(options_);
    const std::uint32_t subgroup = add_block_constants(*device_, constants);
    constants["THREADS"] = static_cast<std::int32_t>(subgroup);
    constants["SEGMENT"] = segmented ? static_cast<std::int32_t>(LIST_SEGMENT) : 0;
    constants["BUCKET"] = static_cast<std::int32_t>(bucket_pairs(*device_));
    constants["WINDOW_PAIRS"] = static_cast<std::int32_t>(window_pairs_);
    segmented_ = segmented;
    if (way_ == BackwardBlend::subgroup) {
        blend_ = Pipeline(*device_, "blend_backward", constants, true, subgroup);
        return;
    }
    if (!blend_) blend_ = Pipeline(*device_, "blend_backward_buckets", constants, true, subgroup);
    constants["THREADS"] = SPLAT_GROUP;
    if (!bucket_tiles_) bucket_tiles_ = Pipeline(*device_, "bucket_tiles", constants);
    bucket_behind_ = Pipeline(*device_, "bucket_behind", constants);
}

// A size is taken note of once its buffers are there, as in Forward.
void BlendBackward::reserve(std::uint32_t pairs, std::uint32_t records) {
    if (records > 0 && bucket_tile_.bytes() < std::uint64_t{records} * 4)
        make_buffers(*device_, *this, bucket_buffers(records), "blend backward");
    if (pairs <= pair_capacity_ && pair_capacity_ > 0) return;
    pair_capacity_ = 0;
    pairs = std::max(pairs, 1024u);
    make_buffers(*device_, *this, pair_buffers(pairs), "blend backward");
    pair_capacity_ = pairs;
    const std::uint64_t most = pairs_of_a_binding(*device_);
    if (window_pairs_ > 0 || pair_capacity_ <= most) return;
    window_pairs_ = static_cast<std::uint32_t>(most);
    make_pipelines(segmented_);
}

BufferRange BlendBackward::partials(std::uint32_t window) const {
    if (window_pairs_ == 0) return partials_;
    const std::uint64_t bytes = window_pairs_ * kPartialBytes;
    const std::uint64_t first = window * bytes < partials_.bytes() ? window * bytes : 0;
    return {partials_, first, std::min(bytes, partials_.bytes() - first)};
}

void BlendBackward::record(Commands& commands, const Forward& forward, const Buffer& d_image,
                           const gpu::CameraData& data, const glm::vec3& background) {
    const std::uint32_t segments = forward.list_segments();
    DARB_CHECK(forward.pair_capacity() <= pair_capacity_, "{} pairs of {}", forward.pair_capacity(),
               pair_capacity_);
    if (segments > 1 && !segmented_) make_pipelines(true);
    if (segments > 1 && behind_.bytes() < forward.size().pixels * 4)
        make_buffers(*device_, *this, segment_buffers(forward.size()), "blend backward");
    commands.fill(partials_, 0);
    commands.fill(rest_, 0);
    const gpu::BlendArgs args{data.width,   data.height, data.tiles_x, background.r, background.g,
                              background.b, 0,           segments};
    if (way_ == BackwardBlend::subgroup)
        record_subgroup(commands, forward, d_image, args);
    else
        record_buckets(commands, forward, d_image, args);
}

// Long lists take several dispatches, the last part of every list first.
void BlendBackward::record_subgroup(Commands& commands, const Forward& forward,
                                    const Buffer& d_image, gpu::BlendArgs args) {
    const std::uint32_t tiles_y = (args.height + TILE_SIZE - 1) / TILE_SIZE;
    for (args.segment = args.segments; args.segment-- > 0;)
        commands.dispatch(blend_, args,
                          {forward.tile_range(), forward.pair_order(), forward.pair_splat(),
                           forward.splat_shape(), forward.splat_light(), forward.splat_bound(),
                           d_image, forward.final_transmittance(), forward.last_pair(), partials(0),
                           partials(1), partials(2), partials(3), partials(4), rest_, behind_},
                          args.tiles_x, tiles_y);
}

void BlendBackward::record_buckets(Commands& commands, const Forward& forward,
                                   const Buffer& d_image, gpu::BlendArgs args) {
    const std::uint32_t records = forward.checkpoint_records();
    DARB_CHECK(records > 0, "the forward pass stores no checkpoints");
    reserve(pair_capacity_, records);
    const std::uint32_t tiles_y = (args.height + TILE_SIZE - 1) / TILE_SIZE;
    const gpu::BucketArgs buckets{args.width, args.height, args.tiles_x, records};
    commands.fill(bucket_tile_, 0);
    commands.dispatch(bucket_tiles_, buckets, {forward.tile_range(), bucket_tile_}, args.tiles_x,
                      tiles_y);
    for (args.segment = args.segments; args.segment-- > 0;)
        commands.dispatch(bucket_behind_, args,
                          {forward.tile_range(), d_image, forward.last_pair(),
                           forward.checkpoints(), behind_, bucket_rest_},
                          args.tiles_x, tiles_y, TILE_SIZE * TILE_SIZE / SPLAT_GROUP);
    const Groups g = groups_for(records, 1);
    commands.dispatch(
        blend_, buckets,
        {forward.tile_range(), forward.pair_order(), forward.pair_splat(), forward.splat_shape(),
         forward.splat_light(), forward.splat_bound(), d_image, forward.last_pair(), bucket_tile_,
         forward.checkpoints(), bucket_rest_, partials_, rest_},
        g.x, g.y);
}

}  // namespace darb
