// The buffers of Forward: the lists that it makes them from, and what they take together.
#include "engine/raster/forward.h"

namespace darb {

BufferList<Forward> Forward::fixed_buffers() {
    return {{&Forward::status_, "frame status", sizeof(gpu::FrameStatus)},
            {&Forward::groups_, "frame groups", sizeof(gpu::FrameGroups)},
            {&Forward::splat_total_, "splat total", 4},
            {&Forward::visible_total_, "visible total", 4},
            {&Forward::visible_in_use_, "visible in use", 4},
            {&Forward::pairs_total_, "pairs total", 4},
            {&Forward::pairs_in_use_, "pairs in use", 4},
            {&Forward::no_huge_rank_, "no huge splats", 4}};
}

BufferList<Forward> Forward::splat_buffers(const ForwardOptions& options, std::uint64_t splats) {
    const std::uint64_t n = splats, light = options.storage == STORAGE_FLOAT16 ? 8 : 16;
    return {{&Forward::splat_shape_, "splat shape", n * 16},
            {&Forward::splat_light_, "splat light", n * light},
            {&Forward::splat_bound_, "splat bound", n * 16},
            {&Forward::cover_, "tile cover", n * 16},
            {&Forward::pair_count_, "pair count", n * 4},
            {&Forward::visible_, "visible", n * 4},
            {&Forward::visible_offset_, "visible offset", n * 4},
            {&Forward::depth_key_, "depth key", n * 4},
            {&Forward::depth_order_, "depth order", n * 4},
            {&Forward::pair_count_sorted_, "pair count by depth", n * 4},
            {&Forward::pair_offset_, "pair offset", n * 4},
            {&Forward::pair_begin_, "pair begin", n * 4}};
}

BufferList<Forward> Forward::pair_buffers(std::uint64_t pairs) {
    return {{&Forward::pair_tile_, "pair tile", pairs * 4},
            {&Forward::pair_splat_, "pair splat", pairs * 4},
            {&Forward::pair_order_, "pair order", pairs * 4}};
}

// At most so many huge splats begin within the capacity, each with more than HUGE_PAIRS pairs.
BufferList<Forward> Forward::huge_buffers(std::uint64_t pairs) {
    return {{&Forward::huge_rank_, "huge splats", (pairs / HUGE_PAIRS + 1) * 4}};
}

BufferList<Forward> Forward::tile_buffers(std::uint64_t tiles) {
    return {{&Forward::tile_range_, "tile range", tiles * 8}};
}

BufferList<Forward> Forward::checkpoint_buffers(std::uint64_t records) {
    return {{&Forward::checkpoints_, "checkpoints", records > 0 ? records * CHECKPOINT_BYTES : 4}};
}

BufferList<Forward> Forward::pixel_buffers(const ForwardOptions& options, std::uint64_t pixels,
                                           std::uint32_t list_segments) {
    const bool store = options.store_for_backward;
    return {{&Forward::image_, "image", pixels * 12},
            {&Forward::final_transmittance_, "final transmittance",
             store || list_segments > 1 ? pixels * 4 : 4},
            {&Forward::last_pair_, "last pair", store ? pixels * 4 : 4}};
}

FrameBytes Forward::device_bytes(const Device& device, const ForwardOptions& options,
                                 const FrameSize& size) {
    FrameBytes bytes;
    bytes.splats = charged_bytes(splat_buffers(options, size.splats)) +
                   Scan::device_bytes(size.splats) + RadixSort::device_bytes(device, size.splats);
    bytes.pairs =
        charged_bytes(pair_buffers(size.pairs)) + RadixSort::device_bytes(device, size.pairs);
    if (size.cooperates) bytes.pairs += charged_bytes(huge_buffers(size.pairs));
    bytes.pairs += charged_bytes(checkpoint_buffers(size.checkpoint_records()));
    bytes.images = charged_bytes(fixed_buffers()) + charged_bytes(tile_buffers(size.tiles)) +
                   charged_bytes(pixel_buffers(options, size.pixels, size.list_segments));
    return bytes;
}

}  // namespace darb
