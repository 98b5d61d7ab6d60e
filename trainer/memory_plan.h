// MemoryPlan: how much device memory a training run takes. Exact where splats, intersections and
// degree are given: it adds up the lists from which the parts of the trainer make their buffers.
// What a run will come to is another matter, see forecast.h.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/raster/forward_options.h"
#include "trainer/options.h"

namespace darb {

/// What decides the size of a run.
struct MemoryDemand {
    std::uint64_t splats = 0;         // N
    std::uint64_t intersections = 0;  // K that the buffers hold
    int sh_degree = 3;                // of the buffers
    bool rest_sum = false;            // harmonics make a step in some iterations only
    bool densifies = true;            // density control runs at this N
    bool averages = false;            // the run ends with a mean of the splats
    ForwardOptions frame;
    std::uint64_t room_splats = 0;       // N that the frame's buffers hold, where there were more
    std::uint32_t list_segments = 1;     // as FrameSize
    bool cooperates = false;             // as FrameSize
    std::uint32_t views = 0;             // held-out ones, too
    int width = 1, height = 1;           // px, the most of any view
    std::uint64_t image_pixels = 1;      // of the largest training photo
    std::uint64_t photo_pixels = 0;      // of all training photos together
    std::uint64_t depth_pixels = 0;      // of those with measured depths that are compared
    std::uint32_t exposure_photos = 0;   // photos whose exposure is trained; 0: the effect is off
    bool exposure_grid = false;          // each by a grid of maps
    std::uint32_t smoothing_photos = 0;  // photos that the 3D filter looks at; 0: no anti-aliasing
    Strategy strategy{};
    int batch = 1;
    bool by_views = false;  // steps_by_views()
    bool cameras = false;   // are refined
    // Of the resolution ramp: its smaller photos, of all training photos together, those with
    // depths twice, and cameras.
    std::uint64_t small_pixels = 0;
    std::uint32_t small_cameras = 0;
    bool streams = false;  // photos wait on the host
};

/// Bytes of device memory, by what they are for.
struct MemoryPlan {
    std::uint64_t parameters = 0, moments = 0;
    std::uint64_t frame = 0;          // per splat, of the forward and backward passes
    std::uint64_t intersections = 0;  // per splat-tile intersection
    std::uint64_t photos = 0;         // ground truth, or the two of them that are there at a time
    std::uint64_t images = 0;         // picture, its gradient, what the passes share
    std::uint64_t effects = 0;        // of per-photo exposure, of the 3D filter and of the strategy
    // For a time, beyond the rest: while density control runs; after it, the mean of the last
    // iterations.
    std::uint64_t densify = 0, average = 0;
    std::uint64_t waiting_photos = 0;  // on the host, in no sum here

    /// What is there between iterations, before the mean is.
    std::uint64_t resident() const {
        return parameters + moments + frame + intersections + photos + images + effects;
    }
    std::uint64_t total() const { return resident() + std::max(densify, average); }
};

/// resident() is what Device::allocated_bytes says of a Trainer at this demand, to the byte;
/// total() the peak of a run that ends there, its last round of density control a small one.
MemoryPlan plan_memory(const Device& device, const MemoryDemand& demand);

/// The peak of one round of density control in a run of this demand, from `before` to `after`
/// splats.
std::uint64_t round_peak(const Device& device, const MemoryDemand& demand, std::uint32_t before,
                         std::uint32_t after);

/// The most splats whose plan stays within budget_bytes, with intersections in the demand's
/// proportion to splats; 0 where the photos alone exceed it.
std::uint64_t splats_within(const Device& device, const MemoryDemand& demand,
                            std::uint64_t budget_bytes);

/// What a data set, the run's effects and its strategy demand: all but splats, intersections and
/// densifies. sh_degree: the highest that the run may reach. Of a resolution ramp: its larger step.
void add_photos(const std::vector<View>& views, const TrainOptions& options, MemoryDemand& demand);

}  // namespace darb
