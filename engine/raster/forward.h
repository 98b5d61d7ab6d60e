// Forward: the walk from splats to an image, recorded top to bottom in one function:
// project -> scan -> compact -> depth sort -> scan -> emit -> tile sort -> ranges -> blend.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "engine/gpu/buffer_list.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/primitives/radix_sort.h"
#include "engine/primitives/scan.h"
#include "engine/primitives/tuning.h"
#include "engine/raster/effects.h"
#include "engine/raster/gpu_splats.h"
#include "engine/scene/camera.h"
#include "shaders/shared/accuracy_list.h"
#include "shaders/shared/limits.h"
#include "shaders/shared/render_args.h"

namespace darb {

/// What is fixed at pipeline creation, each a specialization constant.
struct ForwardOptions {
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    int evaluation = EVALUATION_POLYNOMIAL;
    int polynomial_degree = 5;
    float alpha_cutoff = static_cast<float>(ALPHA_CUTOFF_DEFAULT);
    float transmittance_stop = static_cast<float>(TRANSMITTANCE_STOP);
    int storage = STORAGE_FLOAT32;         // of projected splats
    int depth_order = DEPTH_ORDER_CENTRE;  // DEPTH_ORDER_PIXEL: forward only
    int sh_stored = 0;                     // degree of the buffers
    ProjectionEffects effects;
    bool store_for_backward = false;
    bool backward_follows = true;  // false: what is stored is looked at, without a backward pass
    Crowds crowds = Crowds::by_counters;
};

/// What the buffers of a frame are made for.
struct FrameSize {
    std::uint32_t splats = 0, pairs = 0;
    std::uint64_t pixels = 0;         // of the largest image
    std::uint32_t tiles = 0;          // of the image with the most
    std::uint32_t list_segments = 1;  // dispatches of the blend passes
    bool cooperates = false;          // some frame had huge splats
    std::uint32_t bucket = 0;         // pairs of a checkpoint; 0: there are none
    /// Of every tile one more than its full buckets.
    std::uint64_t checkpoint_records() const {
        return bucket > 0 ? pairs / bucket + std::uint64_t{tiles} : 0;
    }
};
/// Tiles of an image.
std::uint32_t image_tiles(int width, int height);

/// What the transmittance of a pixel stays at or above: the stop less its slack for rounding.
constexpr float least_transmittance(float stop) {
    return static_cast<float>(stop * (1 - TRANSMITTANCE_SLACK));
}

/// Device memory, by what it grows with.
struct FrameBytes {
    std::uint64_t splats = 0, pairs = 0, images = 0;  // images: pixels, tiles and what is fixed
    FrameBytes& operator+=(const FrameBytes& other) {
        splats += other.splats;
        pairs += other.pairs;
        images += other.images;
        return *this;
    }
};

/// The constants of these options that several passes share: kernel, storage and depth order.
SpecConstants kernel_constants(const ForwardOptions& options);

/// A camera as the shaders read it. origin: SplatModel::origin, taken out of the pose in double.
gpu::CameraData camera_data(const Camera& camera, const glm::dvec3& origin,
                            float near_plane = static_cast<float>(NEAR_DEFAULT));

/// Cameras in a device buffer, in the order given.
Buffer upload_cameras(Device& device, const std::vector<gpu::CameraData>& cameras);

/// The subgroup size that the blend passes are compiled for and require.
std::uint32_t blend_subgroup(const Device& device);
/// Pairs of a tile's list between two checkpoints, where the device blends back by buckets.
std::uint32_t bucket_pairs(const Device& device);
/// Sets what shaders/lib/area.glsl and lockstep.glsl ask for, an area a block; returns the subgroup
/// size to require.
std::uint32_t add_block_constants(const Device& device, SpecConstants& constants);

class Forward {
  public:
    Forward(Device& device, const ForwardOptions& options);

    /// Makes the buffers fit: never shrinks. pairs: a guess, as a frame that needs more says so.
    /// The queue must be idle.
    void reserve(std::uint32_t splats, std::uint32_t pairs, int width, int height);
    std::uint32_t pair_capacity() const { return size_.pairs; }
    /// What the buffers are made for now.
    const FrameSize& size() const { return size_; }
    /// Device memory of a Forward whose size() this is.
    static FrameBytes device_bytes(const Device& device, const ForwardOptions& options,
                                   const FrameSize& size);
    /// How many dispatches the blend passes take, LIST_SEGMENT pairs of every tile's list each.
    std::uint32_t list_segments() const { return size_.list_segments; }
    /// After a frame whose status is given: false where it is whole. Else makes room for what it
    /// wanted, half as many pairs again where memory allows it, and clears the status; the frame
    /// must then be recorded again. Throws Error where it can never fit. The queue must be idle.
    /// beside: makes the room that others need beside the pairs that are there then; where it
    /// throws, they are made no more than wanted.
    bool make_room(const gpu::FrameStatus& status, const std::function<void()>& beside = {});
    /// Whether the next frame is emitted with a workgroup for each huge splat. note_crowds: the
    /// counters of a frame decide on the next, where the options leave it to them; make_room calls
    /// it. The queue may be busy.
    bool cooperates() const { return cooperates_; }
    void note_crowds(const gpu::FrameStatus& status);
    /// The most pairs that this device's buffers and bindings allow, in its way of the backward
    /// blend or in another.
    static std::uint32_t max_pairs(const Device& device);
    static std::uint32_t max_pairs(const Device& device, BackwardBlend way);

    /// One frame of camera `camera_index` of `cameras` (data: the same on the host), colours up to
    /// sh_degree. Needs reserve() for the splats and the size.
    void record(Commands& commands, const GpuSplats& splats, const Buffer& cameras,
                std::uint32_t camera_index, const gpu::CameraData& data, int sh_degree,
                const glm::vec3& background);

    /// Recorded between the tile ranges and the blend, where set: what a view changes of the
    /// projected splats (splat_light), without a copy of the blend.
    std::function<void(Commands&)> before_blend;
    /// After record() of the same frame: image() then holds sum w z, sum w and 0, w the weight of
    /// each splat in a pixel and z its depth along the optical axis, world units.
    void record_depth(Commands& commands, std::uint32_t splats, const gpu::CameraData& data);

    /// Outputs of the last recorded frame.
    const Buffer& image() const { return image_; }    // float [3][H][W], not clamped
    const Buffer& status() const { return status_; }  // gpu::FrameStatus
    gpu::FrameStatus read_status() const;
    /// The overflow flag and all counters to zero. The queue must be idle.
    void clear_status();

    /// After the splats' colour buffers changed their degree.
    void set_sh_stored(int degree);

    // For the backward pass.
    const ForwardOptions& options() const { return options_; }
    const Buffer& splat_shape() const { return splat_shape_; }
    const Buffer& splat_light() const { return splat_light_; }
    const Buffer& splat_bound() const { return splat_bound_; }
    const Buffer& pair_count() const { return pair_count_; }
    const Buffer& pair_begin() const { return pair_begin_; }
    const Buffer& pair_splat() const { return pair_splat_; }
    const Buffer& pair_order() const;
    const Buffer& tile_range() const { return tile_range_; }
    const Buffer& final_transmittance() const { return final_transmittance_; }
    const Buffer& last_pair() const { return last_pair_; }
    /// shaders/lib/bucket.glsl; only where the device blends back by buckets, else 0 records.
    const Buffer& checkpoints() const { return checkpoints_; }
    std::uint32_t checkpoint_records() const {
        return static_cast<std::uint32_t>(checkpoints_.bytes() / CHECKPOINT_BYTES);
    }
    /// Pairs a record; 0: there are none.
    std::uint32_t bucket() const { return size_.bucket; }
    /// The same of a Forward that were made now.
    static std::uint32_t bucket(const Device& device, const ForwardOptions& options);

  private:
    static BufferList<Forward> fixed_buffers();
    static BufferList<Forward> splat_buffers(const ForwardOptions& options, std::uint64_t splats);
    static BufferList<Forward> pair_buffers(std::uint64_t pairs);
    static BufferList<Forward> huge_buffers(std::uint64_t pairs);
    static BufferList<Forward> tile_buffers(std::uint64_t tiles);
    static BufferList<Forward> checkpoint_buffers(std::uint64_t records);
    static BufferList<Forward> pixel_buffers(const ForwardOptions& options, std::uint64_t pixels,
                                             std::uint32_t list_segments);
    Pipeline& project_pipeline(int sh_degree);
    void record_depth_order(Commands& commands, std::uint32_t splat_count, float near_plane);
    void record_pairs(Commands& commands, const gpu::CameraData& data, std::uint32_t splat_count);
    void record_blend(Commands& commands, const gpu::CameraData& data, const glm::vec3& background);
    void make_blend(std::uint32_t segments);
    void make_cooperation();
    bool within_budget(std::uint32_t pairs) const;
    void make_room_for(std::uint32_t wanted, std::uint32_t most,
                       const std::function<void()>& beside);

    Device* device_;
    ForwardOptions options_;
    std::uint32_t blend_threads_;
    std::map<int, Pipeline> project_;  // by SH degree in use
    Pipeline compact_, gather_counts_, groups_visible_, groups_pairs_, emit_, tile_ranges_,
        list_lengths_, blend_;
    std::optional<Pipeline> depth_light_;              // made when a depth image is first asked for
    std::optional<Pipeline> emit_others_, emit_huge_;  // made when a frame first has huge splats
    bool cooperates_ = false;
    std::optional<Scan> scan_;
    std::optional<RadixSort> depth_sort_, tile_sort_;
    FrameSize size_;

    Buffer status_, groups_, splat_total_, visible_total_, visible_in_use_, pairs_total_,
        pairs_in_use_;
    Buffer splat_shape_, splat_light_, splat_bound_, cover_, pair_count_, visible_, visible_offset_;
    Buffer depth_key_, depth_order_, pair_count_sorted_, pair_offset_, pair_begin_;
    Buffer pair_tile_, pair_splat_, pair_order_, tile_range_;
    Buffer huge_rank_,
        no_huge_rank_;  // [pair capacity / HUGE_PAIRS + 1] once there are any; a word
    Buffer image_, final_transmittance_, last_pair_, checkpoints_;
};

}  // namespace darb
