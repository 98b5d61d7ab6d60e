#include "engine/raster/forward.h"

#include <algorithm>
#include <bit>
#include <cstddef>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/primitives/groups.h"
#include "engine/raster/blend_backward.h"
#include "engine/raster/frame_limit.h"
#include "engine/raster/kernel_constants.h"
#include "shaders/shared/lens.h"

namespace darb {

namespace {

constexpr std::uint32_t kMinCapacity = 1024;

std::uint32_t tiles(std::uint32_t pixels) {
    return (pixels + TILE_SIZE - 1) / TILE_SIZE;
}

int bits_for(std::uint32_t count) {
    return std::max(1, static_cast<int>(std::bit_width(count > 0 ? count - 1 : 0)));
}

// The widest entry of a pair is a word, but for the sums of the backward blend.
std::uint64_t most_pairs(const Device& device) {
    return std::min({device.info().max_storage_buffer_bytes / 4, std::uint64_t{1} << 30,
                     RadixSort::max_capacity(device)});
}

std::uint32_t most_pairs(const Device& device, const ForwardOptions& options) {
    return options.store_for_backward && options.backward_follows
               ? Forward::max_pairs(device)
               : static_cast<std::uint32_t>(most_pairs(device));
}

}  // namespace

std::uint32_t image_tiles(int width, int height) {
    return tiles(static_cast<std::uint32_t>(width)) * tiles(static_cast<std::uint32_t>(height));
}

SpecConstants kernel_constants(const ForwardOptions& options) {
    SpecConstants constants =
        kernel_constants(options.kernel, options.footprint, options.evaluation,
                         options.polynomial_degree, options.alpha_cutoff);
    constants["STORAGE"] = options.storage;
    constants["DEPTH_ORDER"] = options.depth_order;
    return constants;
}

gpu::CameraData camera_data(const Camera& camera, const glm::dvec3& origin, float near_plane) {
    gpu::CameraData d{};
    const glm::dmat3 rows = glm::transpose(camera.rotation);  // glm columns of the transpose = rows
    d.row0 = glm::vec3(rows[0]);
    d.row1 = glm::vec3(rows[1]);
    d.row2 = glm::vec3(rows[2]);
    const glm::dvec3 centre = camera.centre() - origin;
    d.centre = glm::vec3(centre);
    d.centre_rest = glm::vec3(centre - glm::dvec3(d.centre));
    d.focal = glm::vec2(camera.fx, camera.fy);
    d.principal = glm::vec2(camera.cx, camera.cy);
    glm::dvec2 low(-camera.cx / camera.fx, -camera.cy / camera.fy);
    glm::dvec2 high((camera.width - camera.cx) / camera.fx,
                    (camera.height - camera.cy) / camera.fy);
    glm::dvec2 margin =
        JACOBIAN_MARGIN * 0.5 * glm::dvec2(camera.width / camera.fx, camera.height / camera.fy);
    d.lens_fold = static_cast<float>(LENS_FOLD_NONE);
    if (const LensTerms& lens = camera.lens; lens.active) {
        low = lens.ray_min;
        high = lens.ray_max;
        margin = JACOBIAN_MARGIN * 0.5 * (high - low);
        d.lens_radial = glm::vec4(lens.k[0], lens.k[1], lens.k[2], lens.k[3]);
        d.lens_rational = glm::vec3(lens.d[0], lens.d[1], lens.d[2]);
        d.lens_tangential = glm::vec2(lens.tangential);
        d.lens_prism = glm::vec2(lens.prism);
        d.lens_front = glm::vec2(lens.front_tan, lens.front_scale);
        d.lens_fold = static_cast<float>(lens.fold);
    }
    d.ratio_min = glm::vec2(low - margin);
    d.ratio_max = glm::vec2(high + margin);
    d.width = static_cast<std::uint32_t>(camera.width);
    d.height = static_cast<std::uint32_t>(camera.height);
    d.tiles_x = tiles(d.width);
    d.tiles_y = tiles(d.height);
    d.near_plane = near_plane;
    return d;
}

Buffer upload_cameras(Device& device, const std::vector<gpu::CameraData>& cameras) {
    Buffer buffer(device, "cameras", cameras.size() * sizeof(gpu::CameraData));
    if (!cameras.empty()) buffer.upload(cameras);
    return buffer;
}

std::uint32_t blend_subgroup(const Device& device) {
    return std::clamp(device.info().subgroup_size, 4u, 64u);
}

std::uint32_t bucket_pairs(const Device& device) {
    return std::max(BUCKET_PAIRS, blend_subgroup(device));
}

std::uint32_t add_block_constants(const Device& device, SpecConstants& constants) {
    const std::uint32_t subgroup = blend_subgroup(device);
    constants["SUBGROUP_SIZE"] = static_cast<std::int32_t>(subgroup);
    constants["PIXELS"] = static_cast<std::int32_t>(64 / subgroup);
    constants["LOCKSTEP"] = device.info().type == "cpu" ? 1 : 0;
    return subgroup;
}

Forward::Forward(Device& device, const ForwardOptions& options)
    : device_(&device), options_(options) {
    DARB_CHECK(!options.store_for_backward || options.depth_order != DEPTH_ORDER_PIXEL,
               "a resorted pixel cannot be walked back");
    blend_threads_ = tuning_of(device).blend_threads;
    size_.bucket = bucket(device, options);
    const SpecConstants per_item{{"THREADS", SPLAT_GROUP}};
    SpecConstants of_splat = kernel_constants(options);
    of_splat["THREADS"] = SPLAT_GROUP;
    compact_ = Pipeline(device, "compact", of_splat);
    gather_counts_ = Pipeline(device, "gather_counts", per_item);
    groups_visible_ = Pipeline(device, "frame_groups", {{"THREADS", 1}, {"STAGE", 0}}, false);
    groups_pairs_ = Pipeline(device, "frame_groups", {{"THREADS", 1}, {"STAGE", 1}}, false);
    tile_ranges_ = Pipeline(device, "tile_ranges", per_item);
    list_lengths_ = Pipeline(device, "list_lengths", per_item);
    emit_ = Pipeline(device, "emit", of_splat);
    cooperates_ = options.crowds == Crowds::always;
    if (cooperates_) make_cooperation();
    make_blend(options.crowds == Crowds::always ? 2 : 1);
    make_buffers(device, *this, fixed_buffers(), "project");
    make_buffers(device, *this, checkpoint_buffers(0), "blend");
    clear_status();
}

void Forward::make_blend(std::uint32_t segments) {
    SpecConstants blend = kernel_constants(options_);
    blend["MIN_TRANSMITTANCE"] = least_transmittance(options_.transmittance_stop);
    blend["STORE_FOR_BACKWARD"] = options_.store_for_backward ? 1 : 0;
    const std::uint32_t subgroup = add_block_constants(*device_, blend);
    blend["THREADS"] = static_cast<std::int32_t>(blend_threads_);
    blend["PIXELS"] = static_cast<std::int32_t>(TILE_SIZE * TILE_SIZE / blend_threads_);
    blend["CHECKPOINTS"] = size_.bucket > 0 ? 1 : 0;
    if (size_.bucket > 0) blend["BUCKET"] = static_cast<std::int32_t>(size_.bucket);
    blend["SEGMENT"] = segments > 1 ? static_cast<std::int32_t>(LIST_SEGMENT) : 0;
    blend_ = Pipeline(*device_, "blend", blend, true, subgroup);
    size_.list_segments = segments;
}

// At most so many huge splats begin within the capacity, each with more than HUGE_PAIRS pairs.
void Forward::make_cooperation() {
    if (!emit_huge_) {
        SpecConstants constants = kernel_constants(options_);
        constants["THREADS"] = SPLAT_GROUP;
        constants["COOPERATE"] = 1;
        emit_others_.emplace(*device_, "emit", constants);
        emit_huge_.emplace(*device_, "emit_huge", kernel_constants(options_));
    }
    const BufferList<Forward> buffers = huge_buffers(size_.pairs);
    if (!huge_rank_ || huge_rank_.bytes() < buffers.front().bytes)
        make_buffers(*device_, *this, buffers, "emit");
    size_.cooperates = true;
}

void Forward::note_crowds(const gpu::FrameStatus& status) {
    if (options_.crowds != Crowds::by_counters) return;
    cooperates_ = status.huge_splats > 0;
    if (cooperates_ && !emit_huge_) make_cooperation();
}

// Whether the budget holds so many pairs, with a backward pass of them where there is to be one.
bool Forward::within_budget(std::uint32_t pairs) const {
    const std::uint64_t budget = device_->memory_budget();
    const auto bytes = [&](std::uint32_t of) {
        FrameSize size = size_;
        size.pairs = of;
        const std::uint64_t own = device_bytes(*device_, options_, size).pairs;
        const bool backward = options_.store_for_backward && options_.backward_follows;
        return backward ? own + BlendBackward::device_bytes(size).pairs : own;
    };
    return budget == 0 || device_->allocated_bytes() + bytes(pairs) <= budget + bytes(size_.pairs);
}

// Half as many again, so that fuller frames need no further round; where memory does not allow it,
// just those.
void Forward::make_room_for(std::uint32_t wanted, std::uint32_t most,
                            const std::function<void()>& beside) {
    const auto ample =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(wanted + wanted / 2ull, most));
    if (ample > wanted && within_budget(ample)) {
        try {
            reserve(size_.splats, ample, 1, 1);
            if (beside) beside();
            return;
        } catch (const Error&) {  // the device refuses what the budget allows
            size_.pairs = 0;
            if (size_.bucket > 0) checkpoints_ = Buffer();
        }
    }
    reserve(size_.splats, wanted, 1, 1);
    if (beside) beside();
}

bool Forward::make_room(const gpu::FrameStatus& status, const std::function<void()>& beside) {
    note_crowds(status);
    if (status.overflow == 0) return false;
    const std::uint32_t most = most_pairs(*device_, options_);
    const std::uint32_t wanted =
        (status.overflow & OVERFLOW_TOTAL) != 0 ? 0xFFFFFFFFu : status.pairs;
    if (wanted > most) {
        const std::uint32_t other_way = max_pairs(*device_, BackwardBlend::subgroup);
        const std::string instead =
            size_.bucket > 0 && wanted <= other_way
                ? fmt::format("Start again with --tune backward=subgroup, which holds {}, or lower",
                              other_way)
                : "Lower";
        throw Error("splat-tile pairs",
                    fmt::format("a frame needs {}{} pairs, this device's buffers hold {}",
                                wanted == 0xFFFFFFFFu ? "more than " : "", wanted, most),
                    instead + " the resolution (-r) or the number of splats (--cap-max).");
    }
    if ((status.overflow & OVERFLOW_PAIRS) != 0) make_room_for(wanted, most, beside);
    const std::uint32_t segments = (status.longest_list + LIST_SEGMENT - 1) / LIST_SEGMENT;
    if (segments > size_.list_segments) {
        make_blend(segments + segments / 4);
        if (!options_.store_for_backward)  // the pixels' state is kept between dispatches
            make_buffers(*device_, *this,
                         pixel_buffers(options_, size_.pixels, size_.list_segments), "blend");
    }
    clear_status();
    return true;
}

void Forward::set_sh_stored(int degree) {
    if (degree != options_.sh_stored) project_.clear();
    options_.sh_stored = degree;
}

Pipeline& Forward::project_pipeline(int sh_degree) {
    const auto found = project_.find(sh_degree);
    if (found != project_.end()) return found->second;
    SpecConstants constants = kernel_constants(options_);
    constants["THREADS"] = SPLAT_GROUP;
    constants["SH_DEGREE"] = sh_degree;
    constants["SH_STORED"] = options_.sh_stored;
    add_constants(options_.effects, constants);
    return project_.emplace(sh_degree, Pipeline(*device_, "project", constants)).first->second;
}

std::uint32_t Forward::max_pairs(const Device& device) {
    return max_pairs(device, tuning_of(device).backward);
}

std::uint32_t Forward::max_pairs(const Device& device, BackwardBlend way) {
    // Of the checkpoints' records half are left for the tiles, whose last buckets are not full.
    std::uint64_t most = std::min(most_pairs(device), BlendBackward::max_pairs(device));
    if (way == BackwardBlend::buckets)
        most = std::min(most, device.info().max_storage_buffer_bytes / CHECKPOINT_BYTES / 2 *
                                  bucket_pairs(device));
    return static_cast<std::uint32_t>(most);
}

std::uint32_t Forward::bucket(const Device& device, const ForwardOptions& options) {
    const bool buckets = tuning_of(device).backward == BackwardBlend::buckets;
    return options.store_for_backward && options.backward_follows && buckets ? bucket_pairs(device)
                                                                             : 0;
}

void Forward::reserve(std::uint32_t splats, std::uint32_t pairs, int width, int height) {
    Device& d = *device_;
    const std::uint64_t pixels = std::uint64_t(width) * height;
    // A size is taken note of once its buffers are there: where one cannot be had, the next call
    // makes them all.
    if (splats > size_.splats || size_.splats == 0) {
        size_.splats = 0;
        scan_.reset();
        depth_sort_.reset();
        splats = std::max(splats, kMinCapacity);
        make_buffers(d, *this, splat_buffers(options_, splats), "project");
        scan_.emplace(d, splats);
        depth_sort_.emplace(d, splats);
        size_.splats = splats;
    }
    pairs = std::min(pairs, most_pairs(d, options_));
    if (pairs > size_.pairs || size_.pairs == 0) {
        size_.pairs = 0;
        tile_sort_.reset();
        pairs = std::max(pairs, kMinCapacity);
        make_buffers(d, *this, pair_buffers(pairs), "emit");
        tile_sort_.emplace(d, pairs);
        size_.pairs = pairs;
        if (emit_huge_) make_cooperation();
    }
    if (const std::uint32_t tiled = image_tiles(width, height); tiled > size_.tiles) {
        size_.tiles = 0;
        make_buffers(d, *this, tile_buffers(tiled), "tile ranges");
        size_.tiles = tiled;
    }
    if (pixels > size_.pixels) {
        check_frame(d, width, height);
        size_.pixels = 0;
        make_buffers(d, *this, pixel_buffers(options_, pixels, size_.list_segments), "blend");
        size_.pixels = pixels;
    }
    if (size_.checkpoint_records() > checkpoint_records())
        make_buffers(d, *this, checkpoint_buffers(size_.checkpoint_records()), "blend");
}

void Forward::record(Commands& commands, const GpuSplats& splats, const Buffer& cameras,
                     std::uint32_t camera_index, const gpu::CameraData& data, int sh_degree,
                     const glm::vec3& background) {
    const std::uint32_t n = splats.count();
    DARB_CHECK(n <= size_.splats && std::uint64_t(data.width) * data.height <= size_.pixels,
               "{} splats of {}, {} x {} px", n, size_.splats, data.width, data.height);
    commands.pass("project");
    constexpr std::uint64_t of_frame = offsetof(gpu::FrameStatus, bad_gradients);
    commands.fill(BufferRange(status_, of_frame, sizeof(gpu::FrameStatus) - of_frame), 0);
    for (const SplatRange& range : splats.ranges()) {
        const gpu::ProjectArgs args{range.first, range.first + range.count, camera_index,
                                    static_cast<float>(LOW_PASS_DEFAULT)};
        const Groups g = groups_for(range.count);
        commands.dispatch(
            project_pipeline(sh_degree), args,
            {cameras, splats.parameters(kPosition), splats.parameters(kLogScale),
             splats.parameters(kRotation), splats.parameters(kOpacity), splats.parameters(kShDc),
             splats.rows(splats.parameters(kShRest), range), splat_shape_, splat_light_,
             splat_bound_, cover_, pair_count_, visible_, status_, splats.smoothing()},
            g.x, g.y);
    }
    record_depth_order(commands, n, data.near_plane);
    record_pairs(commands, data, n);
    record_blend(commands, data, background);
}

void Forward::record_depth(Commands& commands, std::uint32_t splats, const gpu::CameraData& data) {
    if (!depth_light_)
        depth_light_.emplace(*device_, "depth_light", SpecConstants{{"THREADS", SPLAT_GROUP}});
    DARB_CHECK(options_.storage == STORAGE_FLOAT32, "depths need the range of float32");
    commands.pass("depth");
    if (splats > 0) {
        const Groups g = groups_for(splats);
        commands.dispatch(*depth_light_, gpu::SplatArgs{splats}, {splat_bound_, splat_light_}, g.x,
                          g.y);
    }
    record_blend(commands, data, glm::vec3(0.0f));
}

void Forward::record_blend(Commands& commands, const gpu::CameraData& data,
                           const glm::vec3& background) {
    if (before_blend) before_blend(commands);
    commands.pass("blend");
    for (std::uint32_t segment = 0; segment < size_.list_segments; ++segment) {
        const gpu::BlendArgs blend{data.width,   data.height,  data.tiles_x, background.r,
                                   background.g, background.b, segment,      size_.list_segments};
        commands.dispatch(blend_, blend,
                          {tile_range_, pair_order(), pair_splat_, splat_shape_, splat_light_,
                           splat_bound_, image_, final_transmittance_, last_pair_, checkpoints_},
                          data.tiles_x, data.tiles_y);
    }
}

void Forward::record_depth_order(Commands& commands, std::uint32_t n, float near_plane) {
    const gpu::CompactArgs args{n, near_plane};
    const gpu::PairArgs pair_args{size_.pairs, 0, 0, 0};
    const Groups g = groups_for(n);
    commands.pass("compact");
    commands.fill(splat_total_, n);
    scan_->record(commands, visible_, visible_offset_, splat_total_, 0, visible_total_);
    commands.dispatch(groups_visible_, pair_args,
                      {status_, groups_, visible_total_, visible_in_use_}, 1);
    commands.dispatch(compact_, args,
                      {visible_, visible_offset_, splat_bound_, depth_key_, depth_order_}, g.x,
                      g.y);
    commands.pass("depth sort");
    const int key_bits = options_.depth_order == DEPTH_ORDER_CENTRE16 ? DEPTH_KEY_BITS : 32;
    depth_sort_->record(commands, depth_key_, depth_order_, visible_in_use_, 0, key_bits);
}

void Forward::record_pairs(Commands& commands, const gpu::CameraData& data, std::uint32_t n) {
    const std::uint32_t tile_count = data.tiles_x * data.tiles_y;
    const gpu::PairArgs args{size_.pairs, data.tiles_x, tile_count,
                             size_.list_segments * LIST_SEGMENT};
    commands.pass("emit");
    commands.dispatch_indirect(gather_counts_, gpu::SplatArgs{n},
                               {status_, depth_order_, pair_count_, pair_count_sorted_}, groups_,
                               offsetof(gpu::FrameGroups, visible_x));
    scan_->record(commands, pair_count_sorted_, pair_offset_, visible_in_use_, 0, pairs_total_);
    commands.dispatch(groups_pairs_, args, {status_, groups_, pairs_total_, pairs_in_use_}, 1);
    commands.dispatch_indirect(
        cooperates_ ? *emit_others_ : emit_, args,
        {status_, depth_order_, pair_offset_, cover_, pair_tile_, pair_splat_, pair_begin_,
         splat_shape_, splat_bound_, cooperates_ ? huge_rank_ : no_huge_rank_},
        groups_, offsetof(gpu::FrameGroups, visible_x));
    if (cooperates_)
        commands.dispatch(*emit_huge_, args,
                          {status_, depth_order_, pair_offset_, cover_, pair_tile_, pair_splat_,
                           huge_rank_, splat_shape_, splat_bound_},
                          EMIT_HUGE_GROUPS);

    commands.pass("tile sort");
    tile_sort_->record(commands, pair_tile_, pair_order_, pairs_in_use_, 0, bits_for(tile_count),
                       true);

    commands.pass("tile ranges");
    commands.fill(tile_range_, 0);
    commands.dispatch_indirect(tile_ranges_, args, {pairs_in_use_, pair_tile_, tile_range_},
                               groups_, offsetof(gpu::FrameGroups, pairs_x));
    const Groups g = groups_for(tile_count);
    commands.dispatch(list_lengths_, args, {status_, tile_range_}, g.x, g.y);
}

const Buffer& Forward::pair_order() const {
    return pair_order_;
}

gpu::FrameStatus Forward::read_status() const {
    return status_.download<gpu::FrameStatus>(1)[0];
}

void Forward::clear_status() {
    status_.upload(std::vector<gpu::FrameStatus>(1));
}

}  // namespace darb
