// SPDX-License-Identifier: MIT
// Frame: the device memory of one frame, plain structs of buffers. Forward writes them, Backward
// and whoever shows a frame read them, FrameBuffers makes them and lets them grow. An intersection
// is a splat in a tile; N splats, K intersections, T tiles, H x W pixels.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/gpu/buffer.h"
#include "engine/primitives/radix_sort.h"
#include "engine/primitives/scan.h"
#include "engine/raster/tile_lists.h"
#include "shaders/shared/render_args.h"

namespace darb {

/// What the buffers of a frame are made for.
struct FrameSize {
    std::uint32_t splats = 0, intersections = 0;
    std::uint64_t pixels = 0;         // pixels of the largest image
    std::uint32_t tiles = 0;          // tiles of the image with the most
    std::uint32_t list_segments = 1;  // dispatches of the blend passes, LIST_SEGMENT of a list each
    bool cooperates = false;          // some frame had huge splats
    bool deep = false;                // some frame had depths beyond SHORT_DEPTH_BITS
    std::uint32_t bucket = 0;         // intersections per checkpoint; 0: there are none
    bool shaped = false;              // the kernel has shapes
    bool depth_sum = false, depth_spread = false;  // as in ForwardOptions
    /// Size of a checkpoint.
    std::uint64_t record_bytes() const {
        const std::uint64_t more = depth_spread ? 2 : depth_sum ? 1 : 0;
        return CHECKPOINT_BYTES + more * TILE_SIZE * TILE_SIZE * sizeof(float);
    }
    /// For every tile one more than its full buckets.
    std::uint64_t checkpoint_records() const {
        return bucket > 0 ? intersections / bucket + std::uint64_t{tiles} : 0;
    }
};

/// Device memory, by what it grows with.
struct FrameBytes {
    std::uint64_t splats = 0, intersections = 0,
                  images = 0;  // images: pixels, tiles, what is fixed
    FrameBytes& operator+=(const FrameBytes& other) {
        splats += other.splats;
        intersections += other.intersections;
        images += other.images;
        return *this;
    }
};

/// What the host does not know of a frame while it records it.
struct FrameCounters {
    Buffer status;  // gpu::FrameStatus
    Buffer groups;  // gpu::FrameGroups
    // A word each; in_use: at most what the buffers hold.
    Buffer splats, visible, visible_in_use, intersections, intersections_in_use;
};

/// What the projection leaves of each splat, [N] each, and the order of depth.
struct ProjectedSplats {
    Buffer shape, light, bound;              // as shaders/lib/projected.glsl reads them
    Buffer exponent;                         // for a kernel with shapes; else one word
    Buffer cover, intersection_count;        // the tiles that a splat meets
    Buffer visible, visible_offset;          // 0 or 1, and its sum over the splats before
    Buffer depth_key, splat_from_depth;      // visible splats only, nearest first
    Buffer count_by_depth, offset_by_depth;  // numbers of intersections, in that order
    Buffer first_intersection;               // by splat: where its intersections begin
};

/// Which splats a tile has, nearest first.
struct TileIntersections {
    Buffer tile;  // [K] sorted, but with FrameSorts::lists in the order of emission
    Buffer splat_from_intersection;   // [K] in the order of emission: splat and blocks of the tile
    Buffer intersection_from_sorted;  // [K] by tile, then by depth
    Buffer tile_range;                // [T][2] of that; then the tiles in the order of the blends
    Buffer huge_rank;                 // [K / HUGE_INTERSECTIONS + 1], once a frame had huge splats
    Buffer no_huge_rank;              // a word, in its place until then
};

/// float [3][H][W] not clamped, and the planes of depths that ForwardOptions asks for; what the
/// backward pass walks back from.
struct FrameImages {
    Buffer image;
    Buffer final_transmittance, last_intersection;  // [H][W], where they are stored
    Buffer checkpoints;  // shaders/lib/bucket.glsl; where there are buckets
};

/// Scratch memory of the sorts, each for a capacity.
struct FrameSorts {
    std::optional<Scan> scan;
    std::optional<RadixSort> by_depth;
    std::optional<RadixSort> by_tile;  // one of these two
    std::optional<TileLists> lists;    // by Tuning::count_lists, where the tiles fit
};

struct Frame {
    FrameSize size;
    bool cooperates = false;  // the next frame is emitted with a workgroup for each huge splat
    FrameCounters counters;
    ProjectedSplats splats;
    TileIntersections intersections;
    FrameImages images;
    FrameSorts sorts;

    std::uint32_t checkpoint_records() const {
        return static_cast<std::uint32_t>(images.checkpoints.bytes() / size.record_bytes());
    }
    gpu::FrameStatus read_status() const {
        return counters.status.download<gpu::FrameStatus>(1)[0];
    }
};

}  // namespace darb
