// SPDX-License-Identifier: MIT
// Forward: the pipelines from splats to an image, recorded top to bottom:
// project -> scan -> compact -> depth sort -> scan -> emit -> tile sort -> ranges -> blend.
// It holds no memory of a frame: that is the Frame that it is given.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <utility>

#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/raster/forward_options.h"
#include "engine/raster/frame.h"
#include "engine/raster/frame_view.h"
#include "engine/raster/gpu_splats.h"

namespace darb {

/// The subgroup size that the blend passes are compiled for and require.
std::uint32_t blend_subgroup(const Device& device);
/// Intersections of a tile's list between two checkpoints, where the device blends back by buckets.
std::uint32_t bucket_length(const Device& device);
/// Sets what shaders/lib/area.glsl and lockstep.glsl ask for, an area a block; returns the subgroup
/// size to require.
std::uint32_t add_block_constants(const Device& device, SpecConstants& constants);

class Forward {
  public:
    /// Frames must be made with the same options.
    Forward(Device& device, const ForwardOptions& options);
    const ForwardOptions& options() const { return options_; }
    /// Another kernel from now on, of splats without or with shapes as before. The queue must be
    /// idle.
    void set_kernel(int kernel);

    /// One frame: record_intersections, then record_blend. FrameBuffers::reserve comes before, for
    /// the splats and the size.
    void record(Commands& commands, const GpuSplats& splats, const FrameView& view, Frame& frame);

    /// The two steps of record(), for callers that change the colours of the projected splats
    /// (frame.splats.light) between them: the display modes of a viewer.
    void record_intersections(Commands& commands, const GpuSplats& splats, const FrameView& view,
                              Frame& frame);
    void record_blend(Commands& commands, const FrameView& view, Frame& frame);

    /// After record() of the same view: the image then holds sum w z, sum w and 0, w the weight of
    /// each splat in a pixel and z its depth along the optical axis, world units.
    void record_depth(Commands& commands, std::uint32_t splats, const FrameView& view,
                      Frame& frame);

  private:
    Pipeline& project_pipeline(int sh_degree, int sh_stored);
    Pipeline& blend_pipeline(const Frame& frame);
    /// Whether this frame is blended by records, which neither resort pixels nor leave checkpoints.
    bool blends_records(const Frame& frame) const;
    void make_huge_pipelines();
    void record_projection(Commands& commands, const GpuSplats& splats, const FrameView& view,
                           const Frame& frame);
    void record_depth_order(Commands& commands, std::uint32_t splats, float near_plane,
                            Frame& frame);
    void record_emission(Commands& commands, std::uint32_t splats,
                         const gpu::IntersectionArgs& args, Frame& frame);
    void record_slots(Commands& commands, const gpu::IntersectionArgs& args, Frame& frame);
    void record_tiles(Commands& commands, const gpu::IntersectionArgs& args, Frame& frame);

    Device* device_;
    ForwardOptions options_;
    // By the device's tuning, like the next.
    bool short_depths_, emits_slots_, longest_first_, records_;
    bool half_;                                        // blends in half precision
    std::uint32_t blend_threads_;                      // threads of a tile's workgroup
    std::map<std::pair<int, int>, Pipeline> project_;  // by SH degree in use and in the buffers
    Pipeline compact_, gather_counts_, groups_visible_, groups_intersections_, emit_, tile_ranges_,
        list_lengths_, tile_order_;
    std::array<Pipeline, 2> blend_;          // made when needed: for whole lists, for parts
    std::optional<Pipeline> compact_short_;  // for keys of SHORT_DEPTH_BITS
    std::optional<Pipeline> depth_light_;    // made when a depth image is first asked for
    std::optional<Pipeline> emit_others_, emit_huge_;  // made when a frame first has huge splats
};

}  // namespace darb
