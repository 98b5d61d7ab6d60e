// SPDX-License-Identifier: MIT
#include "engine/raster/frame_buffers.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/raster/blend_backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_view.h"

namespace darb {

namespace {

constexpr std::uint32_t kMinCapacity = 1024;

// The widest entry of an intersection is a word, but for the sums of the backward blend.
std::uint64_t most_intersections(const Device& device) {
    return std::min({device.info().max_storage_buffer_bytes / 4, std::uint64_t{1} << 30,
                     RadixSort::max_capacity(device)});
}

bool walks_back(const ForwardOptions& options) {
    return options.store_for_backward && options.backward_follows;
}

std::uint32_t most_intersections(const Device& device, const ForwardOptions& options) {
    if (!walks_back(options)) return static_cast<std::uint32_t>(most_intersections(device));
    const std::uint32_t most = FrameBuffers::max_intersections(device);
    if (!options.depth_sum) return most;
    // Two floats beside the partials, and larger checkpoints.
    return std::min(most / (options.depth_spread ? 6 : 5) * 4,
                    static_cast<std::uint32_t>(std::min<std::uint64_t>(
                        device.info().max_storage_buffer_bytes / 8, 1u << 30)));
}

// Whether lists are counted: else sorted by digits.
bool counts_lists(const Device& device, std::uint32_t intersections, std::uint32_t tiles) {
    return device.tuning().count_lists && TileLists::fits(device.info(), intersections, tiles);
}

int depth_digit_bits(const Device& device) {
    return device.tuning().short_depths ? RadixSort::kWideDigitBits : RadixSort::kDigitBits;
}

BufferList<FrameCounters> counter_buffers() {
    using C = FrameCounters;
    return {{&C::status, "frame status", sizeof(gpu::FrameStatus)},
            {&C::groups, "frame groups", sizeof(gpu::FrameGroups)},
            {&C::splats, "splat total", 4},
            {&C::visible, "visible total", 4},
            {&C::visible_in_use, "visible in use", 4},
            {&C::intersections, "intersections total", 4},
            {&C::intersections_in_use, "intersections in use", 4}};
}

BufferList<ProjectedSplats> splat_buffers(const ForwardOptions& options, std::uint64_t n) {
    using S = ProjectedSplats;
    const std::uint64_t light = options.storage == STORAGE_FLOAT16 ? 8 : 16;
    return {{&S::shape, "splat shape", n * 16},
            {&S::light, "splat light", n * light},
            {&S::bound, "splat bound", n * 16},
            {&S::exponent, "splat exponent", kernel_has_shape(options.kernel) ? n * 4 : 4},
            {&S::cover, "tile cover", n * 16},
            {&S::intersection_count, "intersection count", n * 4},
            {&S::visible, "visible", n * 4},
            {&S::visible_offset, "visible offset", n * 4},
            {&S::depth_key, "depth key", n * 4},
            {&S::splat_from_depth, "depth order", n * 4},
            {&S::count_by_depth, "count by depth", n * 4},
            {&S::offset_by_depth, "offset by depth", n * 4},
            {&S::first_intersection, "first intersection", n * 4}};
}

BufferList<TileIntersections> intersection_buffers(std::uint64_t k) {
    using I = TileIntersections;
    return {{&I::tile, "tile from intersection", k * 4},
            {&I::splat_from_intersection, "splat from intersection", k * 4},
            {&I::intersection_from_sorted, "intersection from sorted", k * 4}};
}

BufferList<TileIntersections> no_huge_buffers() {
    return {{&TileIntersections::no_huge_rank, "no huge splats", 4}};
}

// At most so many huge splats begin within the capacity, each with more than HUGE_INTERSECTIONS
// tiles.
BufferList<TileIntersections> huge_buffers(std::uint64_t k) {
    return {{&TileIntersections::huge_rank, "huge splats", (k / HUGE_INTERSECTIONS + 1) * 4}};
}

BufferList<TileIntersections> tile_buffers(std::uint64_t tiles) {
    return {{&TileIntersections::tile_range, "tile range", tiles * 16}};
}

BufferList<FrameImages> checkpoint_buffers(const FrameSize& size) {
    const std::uint64_t records = size.checkpoint_records();
    return {{&FrameImages::checkpoints, "checkpoints",
             records > 0 ? records * size.record_bytes() : 4}};
}

BufferList<FrameImages> pixel_buffers(const ForwardOptions& options, std::uint64_t pixels,
                                      std::uint32_t list_segments) {
    const bool store = options.store_for_backward;
    return {{&FrameImages::image, "image", pixels * 4 * image_planes(options)},
            {&FrameImages::final_transmittance, "final transmittance",
             store || list_segments > 1 ? pixels * 4 : 4},
            {&FrameImages::last_intersection, "last intersection", store ? pixels * 4 : 4}};
}

NoRoom too_many(const Device& device, std::uint32_t wanted, std::uint32_t most, bool buckets) {
    const std::uint32_t without = FrameBuffers::max_intersections(device, BackwardBlend::subgroup);
    const std::string instead =
        buckets && wanted <= without
            ? fmt::format("Start again with --tune backward=subgroup, which holds {}, or lower",
                          without)
            : "Lower";
    return NoRoom("splat-tile intersections",
                  fmt::format("a frame needs {}{} intersections, this device's buffers hold {}",
                              wanted == 0xFFFFFFFFu ? "more than " : "", wanted, most),
                  instead + " the resolution (-r) or the number of splats (--cap-max).");
}

}  // namespace

FrameBuffers::FrameBuffers(Device& device, const ForwardOptions& options)
    : device_(&device), options_(options) {
    frame_.size.bucket = bucket(device, options);
    frame_.size.shaped = kernel_has_shape(options.kernel);
    frame_.size.depth_sum = options.depth_sum;
    frame_.size.depth_spread = options.depth_spread;
    make_buffers(device, frame_.counters, counter_buffers(), "project");
    make_buffers(device, frame_.intersections, no_huge_buffers(), "project");
    make_buffers(device, frame_.images, checkpoint_buffers({}), "blend");
    if (options.huge_splat_path == HugeSplatPath::always) {
        frame_.cooperates = true;
        make_huge_buffers();
        frame_.size.list_segments = 2;
    }
    clear_status();
}

FrameBytes FrameBuffers::device_bytes(const Device& device, const ForwardOptions& options,
                                      const FrameSize& size) {
    FrameBytes bytes;
    bytes.splats = charged_bytes(splat_buffers(options, size.splats)) +
                   Scan::device_bytes(size.splats) +
                   RadixSort::device_bytes(device, size.splats, depth_digit_bits(device));
    bytes.intersections = charged_bytes(intersection_buffers(size.intersections)) +
                          (counts_lists(device, size.intersections, size.tiles)
                               ? TileLists::device_bytes(size.intersections, size.tiles)
                               : RadixSort::device_bytes(device, size.intersections));
    if (size.cooperates) bytes.intersections += charged_bytes(huge_buffers(size.intersections));
    bytes.intersections += charged_bytes(checkpoint_buffers(size));
    bytes.images = charged_bytes(counter_buffers()) + charged_bytes(no_huge_buffers()) +
                   charged_bytes(tile_buffers(size.tiles)) +
                   charged_bytes(pixel_buffers(options, size.pixels, size.list_segments));
    return bytes;
}

std::uint32_t FrameBuffers::max_intersections(const Device& device) {
    return max_intersections(device, device.tuning().backward);
}

std::uint32_t FrameBuffers::max_intersections(const Device& device, BackwardBlend backward) {
    // Half of the checkpoint records are left for the tiles, whose last buckets are not full.
    std::uint64_t most =
        std::min(most_intersections(device), BlendBackward::max_intersections(device));
    if (backward == BackwardBlend::buckets)
        most = std::min(most, device.info().max_storage_buffer_bytes / CHECKPOINT_BYTES / 2 *
                                  bucket_length(device));
    return static_cast<std::uint32_t>(most);
}

std::uint32_t FrameBuffers::bucket(const Device& device, const ForwardOptions& options) {
    const bool buckets = device.tuning().backward == BackwardBlend::buckets;
    return walks_back(options) && buckets && !blends_in_half(options) ? bucket_length(device) : 0;
}

// A size is taken note of once its buffers are there: where one cannot be had, the next call makes
// them all.
void FrameBuffers::reserve(std::uint32_t splats, std::uint32_t intersections, int width,
                           int height) {
    const FrameSize& size = frame_.size;
    if (splats > size.splats || size.splats == 0) reserve_splats(std::max(splats, kMinCapacity));
    intersections = std::min(intersections, most_intersections(*device_, options_));
    if (intersections > size.intersections || size.intersections == 0)
        reserve_intersections(std::max(intersections, kMinCapacity));
    reserve_image(width, height);
    make_tile_sort();
    if (size.checkpoint_records() > frame_.checkpoint_records())
        make_buffers(*device_, frame_.images, checkpoint_buffers(size), "blend");
}

void FrameBuffers::reserve_splats(std::uint32_t splats) {
    frame_.size.splats = 0;
    frame_.sorts.scan.reset();
    frame_.sorts.by_depth.reset();
    make_buffers(*device_, frame_.splats, splat_buffers(options_, splats), "project");
    frame_.sorts.scan.emplace(*device_, splats);
    frame_.sorts.by_depth.emplace(*device_, splats, std::nullopt, 0, depth_digit_bits(*device_));
    frame_.size.splats = splats;
}

void FrameBuffers::reserve_intersections(std::uint32_t intersections) {
    frame_.size.intersections = 0;
    frame_.sorts.by_tile.reset();
    frame_.sorts.lists.reset();
    make_buffers(*device_, frame_.intersections, intersection_buffers(intersections), "emit");
    frame_.size.intersections = intersections;
    if (frame_.size.cooperates) make_huge_buffers();
}

// Of what was made before, nothing stays beside it.
void FrameBuffers::make_tile_sort() {
    const FrameSize& size = frame_.size;
    FrameSorts& sorts = frame_.sorts;
    if (counts_lists(*device_, size.intersections, size.tiles)) {
        if (sorts.lists && sorts.lists->tiles() >= size.tiles) return;
        sorts.by_tile.reset();
        sorts.lists.reset();
        sorts.lists.emplace(*device_, size.intersections, size.tiles);
    } else if (!sorts.by_tile) {
        sorts.lists.reset();
        sorts.by_tile.emplace(*device_, size.intersections);
    }
}

void FrameBuffers::reserve_image(int width, int height) {
    FrameSize& size = frame_.size;
    if (const std::uint32_t tiles = image_tiles(width, height); tiles > size.tiles) {
        size.tiles = 0;
        make_buffers(*device_, frame_.intersections, tile_buffers(tiles), "tile ranges");
        size.tiles = tiles;
    }
    if (const std::uint64_t pixels = std::uint64_t(width) * height; pixels > size.pixels) {
        check_frame(*device_, width, height, {}, image_planes(options_));
        size.pixels = 0;
        make_buffers(*device_, frame_.images, pixel_buffers(options_, pixels, size.list_segments),
                     "blend");
        size.pixels = pixels;
    }
}

void FrameBuffers::make_huge_buffers() {
    const auto buffers = huge_buffers(frame_.size.intersections);
    const Buffer& rank = frame_.intersections.huge_rank;
    if (!rank || rank.bytes() < buffers.front().bytes)
        make_buffers(*device_, frame_.intersections, buffers, "emit");
    frame_.size.cooperates = true;
}

void FrameBuffers::note_status(const gpu::FrameStatus& status) {
    if (options_.huge_splat_path != HugeSplatPath::by_counters) return;
    frame_.cooperates = status.huge_splats > 0;
    if (frame_.cooperates && !frame_.size.cooperates) make_huge_buffers();
}

// Whether the budget holds so many, with a backward pass of them where there is to be one.
bool FrameBuffers::within_budget(std::uint32_t intersections) const {
    const std::uint64_t budget = device_->memory_budget();
    const auto bytes = [&](std::uint32_t of) {
        FrameSize size = frame_.size;
        size.intersections = of;
        const std::uint64_t own = device_bytes(*device_, options_, size).intersections;
        return walks_back(options_) ? own + BlendBackward::device_bytes(size).intersections : own;
    };
    return budget == 0 || device_->allocated_bytes() + bytes(intersections) <=
                              budget + bytes(frame_.size.intersections);
}

// Half as many again, so that fuller frames need no further round; where memory does not allow it,
// just those.
void FrameBuffers::grow(std::uint32_t wanted, std::uint32_t most,
                        const std::function<void()>& make_other_buffers) {
    const auto make = [&](std::uint32_t intersections) {
        reserve(frame_.size.splats, intersections, 1, 1);
        if (make_other_buffers) make_other_buffers();
    };
    const auto ample =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(wanted + wanted / 2ull, most));
    if (ample > wanted && within_budget(ample)) {
        try {
            make(ample);
            return;
        } catch (const NoRoom&) {  // the device refuses what the budget allows
            frame_.size.intersections = 0;
            if (frame_.size.bucket > 0) frame_.images.checkpoints = Buffer();
        }
    }
    make(wanted);
}

bool FrameBuffers::make_room(const gpu::FrameStatus& status,
                             const std::function<void()>& make_other_buffers) {
    note_status(status);
    if (status.overflow == 0) return false;
    const std::uint32_t most = most_intersections(*device_, options_);
    const std::uint32_t wanted =
        (status.overflow & OVERFLOW_TOTAL) != 0 ? 0xFFFFFFFFu : status.intersections;
    if (wanted > most) throw too_many(*device_, wanted, most, frame_.size.bucket > 0);
    if ((status.overflow & OVERFLOW_INTERSECTIONS) != 0) grow(wanted, most, make_other_buffers);
    if ((status.overflow & OVERFLOW_DEPTHS) != 0) frame_.size.deep = true;
    segment_lists(status.longest_list);
    clear_status();
    return true;
}

// A quarter more dispatches than this list needs. Where nothing is stored for a backward pass, the
// pixels' state between them needs a buffer.
void FrameBuffers::segment_lists(std::uint32_t longest_list) {
    const std::uint32_t segments = (longest_list + LIST_SEGMENT - 1) / LIST_SEGMENT;
    FrameSize& size = frame_.size;
    if (segments <= size.list_segments) return;
    size.list_segments = segments + segments / 4;
    if (!options_.store_for_backward)
        make_buffers(*device_, frame_.images,
                     pixel_buffers(options_, size.pixels, size.list_segments), "blend");
}

void FrameBuffers::clear_status() {
    frame_.counters.status.upload(std::vector<gpu::FrameStatus>(1));
}

}  // namespace darb
