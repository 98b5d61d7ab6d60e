// MemoryBudget: what a run takes of device memory while it goes: the plan for what it holds now,
// the peak of all plans so far, and where a budget, or the intersections that the device binds,
// stop the growth.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/raster/frame.h"
#include "trainer/memory_plan.h"
#include "trainer/schedule.h"
#include "trainer/trainer_state.h"

namespace darb {

/// What a run holds on the device at a moment.
struct HeldMemory {
    std::uint32_t splats = 0;
    int sh_degree = 0;  // of their buffers
    FrameSize frame;
    bool averages = false;           // a mean of the splats is there
    int divisor = 1;                 // of the photos' sides; above 1 the next two
    std::uint64_t small_pixels = 0;  // of the smaller photos
    std::uint32_t small_cameras = 0;
};

class MemoryBudget {
  public:
    MemoryBudget(Device& device, const Dataset& dataset, const TrainOptions& options,
                 const Schedule& schedule, std::uint32_t start_splats);

    /// Whether photos are to wait on the host: photos_stream() of forecast.h.
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
    TrainOptions options_;
    Schedule schedule_;
    MemoryDemand photos_;  // of photos, effects and strategy alone
    std::array<std::uint64_t, 6> recorded_{};
    std::uint64_t planned_bytes_ = 0;
    std::uint32_t limit_ = 0, within_memory_ = 0;  // of the round under way
    std::uint32_t stopped_by_memory_ = 0, stopped_by_intersections_ = 0;
};

}  // namespace darb
