// SPDX-License-Identifier: MIT
// MemoryPlan: how much device memory a training run takes. Exact where splats, intersections and
// degree are given: it adds up the lists from which the parts of the trainer make their buffers.
// What a run will come to is another matter, see forecast.h.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/raster/forward_options.h"
#include "engine/raster/frame.h"
#include "trainer/options/options.h"
#include "trainer/options/schedule.h"
#include "trainer/step/trainer_state.h"

namespace darb {

/// What decides the size of a run.
struct MemoryDemand {
    std::uint64_t splats = 0;         // N
    std::uint64_t intersections = 0;  // K that the buffers hold
    int sh_degree = 3;                // the buffers' degree
    bool rest_sum = false;            // harmonics make a step in some iterations only
    bool densifies = true;            // density control runs at this N
    bool averages = false;            // the run ends with a mean of the splats
    ForwardOptions frame;
    std::uint64_t room_splats = 0;       // N that the frame's buffers hold, where there were more
    std::uint32_t list_segments = 1;     // as FrameSize
    bool cooperates = false;             // as FrameSize
    std::uint32_t views = 0;             // held-out ones, too
    int width = 1, height = 1;           // px, the most of any view
    std::uint64_t image_pixels = 1;      // the largest training photo
    std::uint64_t photo_pixels = 0;      // all training photos together
    std::uint64_t depth_pixels = 0;      // photos with measured depths that are compared
    std::uint32_t exposure_photos = 0;   // photos whose exposure is trained; 0: the effect is off
    bool exposure_grid = false;          // each by a grid of maps
    std::uint32_t smoothing_photos = 0;  // photos that the 3D filter looks at; 0: no anti-aliasing
    Strategy strategy{};
    int batch = 1;
    bool by_views = false;  // steps_by_views()
    bool cameras = false;   // are refined
    bool profile = false;   // the kernel's profile is learned
    // The resolution ramp's smaller photos: all training photos together, those with depths counted
    // twice, and their cameras.
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
    std::uint64_t effects = 0;        // per-photo exposure, 3D filter and strategy
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
void add_photos(const std::vector<View>& views, const Schedule& schedule, MemoryDemand& demand);

// MemoryBudget: what a run takes of device memory while it goes: the plan for what it holds now,
// the peak of all plans so far, and where a budget, or the intersections that the device binds,
// stop the growth.

/// Whether training photos wait on the host and stream: as Tuning::photos says, else where a run
/// from so many splats has no room for them. A device with memory of its own has it where all that
/// the run is forecast to come to fits into options.max_memory_bytes, or the most of the device
/// that a run can hope for. Where host and device share theirs streaming frees nothing, and a
/// budget alone calls for it, where it does not hold the start. photos: as add_photos gives them.
bool photos_stream(const Device& device, const Dataset& dataset, const Schedule& schedule,
                   const MemoryDemand& photos, std::uint32_t start_splats);
/// How much of the device's memory a run can hope for.
std::uint64_t usable_bytes(const DeviceInfo& info);

/// What a run holds on the device at a moment.
struct HeldMemory {
    std::uint32_t splats = 0;
    int sh_degree = 0;  // degree of their buffers
    FrameSize frame;
    bool averages = false;           // a mean of the splats is there
    int divisor = 1;                 // divides the photos' sides; above 1 the next two
    std::uint64_t small_pixels = 0;  // the smaller photos
    std::uint32_t small_cameras = 0;
};

class MemoryBudget {
  public:
    MemoryBudget(Device& device, const Dataset& dataset, const Schedule& schedule,
                 std::uint32_t start_splats);

    /// Other limits from now on.
    void set_schedule(const Schedule& schedule) { schedule_ = schedule; }

    /// Whether photos are to wait on the host: photos_stream().
    bool streams_photos() const { return photos_.streams; }

    /// What plan_memory() asks for.
    MemoryDemand demand(const HeldMemory& held) const;
    /// The peak that the plans for all that was recorded, and for this, come to.
    std::uint64_t planned_bytes(const HeldMemory& held) const;
    /// Into the peak: what is held now; planned where something has changed.
    void record(const HeldMemory& held);
    /// The same whether it has changed or not.
    void record_peak(const HeldMemory& held) { planned_bytes_ = planned_bytes(held); }
    /// The same of a round of density control just over, with `before` splats at its start. What a
    /// frame works with still has the size from before it.
    void record_round(const HeldMemory& held, std::uint32_t before);

    /// The most splats that a round may come to, by what is asked for, memory and intersections.
    std::uint32_t growth_limit(const HeldMemory& held, const TrainCounters& counters);
    /// After the round that had this limit: whether memory stopped it.
    void end_round(std::uint32_t splats);
    /// The splats at which TrainOptions::max_memory_bytes stopped the growth; 0: it did not.
    std::uint32_t stopped_by_memory() const { return stopped_by_memory_; }
    /// The same where frames came near the intersections that the device's bindings hold.
    std::uint32_t stopped_by_intersections() const { return stopped_by_intersections_; }

    /// Whether a round of density control that adds nothing stays within max_memory_bytes.
    bool has_room_for_round(const HeldMemory& held) const;
    bool has_room_for_degree(const HeldMemory& held, int degree) const;

  private:
    MemoryDemand growth_demand(const HeldMemory& held, const TrainCounters& counters) const;
    std::uint64_t bytes_to_plan(const HeldMemory& held) const;
    std::uint32_t splats_within_memory(const HeldMemory& held, const TrainCounters& counters) const;

    Device* device_;
    Schedule schedule_;
    MemoryDemand photos_;  // only photos, effects and strategy
    std::array<std::uint64_t, 6> recorded_{};
    std::uint64_t planned_bytes_ = 0;
    std::uint32_t limit_ = 0, within_memory_ = 0;  // in the round under way
    std::uint32_t stopped_by_memory_ = 0, stopped_by_intersections_ = 0;
};

}  // namespace darb
