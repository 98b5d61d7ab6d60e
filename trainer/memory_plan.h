// MemoryPlan: how much device memory a training run takes, from the sizes of its buffers (those of
// trainer.cpp, exposure.cpp, smoothing.cpp, gpu_splats.cpp, forward.cpp, backward.cpp,
// radix_sort.cpp and density_control.cpp).
#pragma once

#include <cstdint>
#include <vector>

#include "engine/data/dataset.h"
#include "trainer/options.h"

namespace darb {

/// What decides the size of a run.
struct MemoryDemand {
    std::uint64_t splats = 0;            // N
    std::uint64_t pairs = 0;             // K that the buffers hold
    int sh_degree = 3;                   // of the buffers
    std::uint64_t photo_pixels = 0;      // of all training photos together
    std::uint64_t image_pixels = 0;      // of the largest view: its width times its height
    bool densifies = true;               // density control runs at this N
    std::uint64_t exposure_photos = 0;   // photos whose exposure is trained; 0: the effect is off
    std::uint64_t smoothing_photos = 0;  // photos that the 3D filter looks at; 0: no anti-aliasing
    std::uint64_t image_tiles = 0;       // of the view that has most
    std::uint32_t bucket = 0;  // pairs of a checkpoint: Forward::bucket; 0: there are none
};

/// Bytes of device memory, by what they are for.
struct MemoryPlan {
    std::uint64_t parameters = 0, moments = 0;
    std::uint64_t frame = 0;        // per splat, of the forward and backward passes
    std::uint64_t pairs = 0;        // per splat-tile pair
    std::uint64_t photos = 0;       // ground truth
    std::uint64_t images = 0;       // picture, its gradient, what the blend passes share
    std::uint64_t effects = 0;      // of per-photo exposure and of the 3D filter
    std::uint64_t checkpoints = 0;  // of the backward blend by buckets
    std::uint64_t densify = 0;      // for a moment, while density control runs
    std::uint64_t total() const {
        return parameters + moments + frame + pairs + photos + images + effects + checkpoints +
               densify;
    }
};

/// The peak of a run that ends at this demand; within 10 % of Device::peak_bytes where the demand
/// is right.
MemoryPlan plan_memory(const MemoryDemand& demand);

/// The most splats whose plan stays within budget_bytes, with pairs in the demand's proportion to
/// splats; 0 where the photos alone exceed it.
std::uint64_t splats_within(const MemoryDemand& demand, std::uint64_t budget_bytes);

/// What a data set and the run's effects demand: all but splats, pairs and densifies. sh_degree:
/// the highest that the run may reach.
void add_photos(const std::vector<View>& views, const TrainOptions& options, MemoryDemand& demand);

}  // namespace darb
