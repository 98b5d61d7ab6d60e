#include "trainer/memory_budget.h"

#include <algorithm>

#include "engine/raster/frame_buffers.h"
#include "engine/raster/gpu_splats.h"
#include "trainer/forecast.h"

namespace darb {

namespace {
constexpr std::uint32_t kNoLimit = 0xFFFFFFFFu;
// Of the intersections that the device binds: beyond, splats do not grow in number.
constexpr double kMostIntersections = 0.7;
}  // namespace

MemoryBudget::MemoryBudget(Device& device, const Dataset& dataset, const TrainOptions& options,
                           const Schedule& schedule, std::uint32_t start_splats)
    : device_(&device), options_(options), schedule_(schedule) {
    add_photos(dataset.views, options, photos_);
    photos_.streams = photos_stream(device, dataset, options, photos_, start_splats);
}

MemoryDemand MemoryBudget::demand(const HeldMemory& held) const {
    MemoryDemand demand = photos_;
    demand.splats = held.splats;
    demand.room_splats = held.frame.splats;
    demand.intersections = held.frame.intersections;
    demand.list_segments = held.frame.list_segments;
    demand.cooperates = held.frame.cooperates;
    demand.sh_degree = held.sh_degree;
    demand.densifies = false;
    demand.averages = held.averages;
    demand.small_pixels = held.small_pixels;
    demand.small_cameras = held.small_cameras;
    return demand;
}

std::uint64_t MemoryBudget::planned_bytes(const HeldMemory& held) const {
    return std::max(planned_bytes_, plan_memory(*device_, demand(held)).total());
}

void MemoryBudget::record(const HeldMemory& held) {
    const std::array<std::uint64_t, 6> now{held.splats,
                                           held.frame.intersections,
                                           std::uint64_t(held.sh_degree),
                                           held.frame.list_segments,
                                           held.frame.cooperates,
                                           std::uint64_t(held.divisor)};
    if (now == recorded_) return;
    recorded_ = now;
    planned_bytes_ = planned_bytes(held);
}

void MemoryBudget::record_round(const HeldMemory& held, std::uint32_t before) {
    MemoryDemand round = demand(held);
    round.splats = before;
    planned_bytes_ = std::max(planned_bytes_, round_peak(*device_, round, before, held.splats));
}

// Of a frame with half more intersections than the fullest so far, in buffers that grew to half
// more than those. From what a checkpoint holds, not from the size that the buffers came to have: a
// run that is resumed, or shows other pictures meanwhile, has the same limit.
MemoryDemand MemoryBudget::growth_demand(const HeldMemory& held,
                                         const TrainCounters& counters) const {
    MemoryDemand grown = demand(held);
    std::uint64_t most = counters.most_intersections;
    if (held.divisor > 1) {
        // Photos of the ramp's larger step are still to come, and frames in which a splat has more
        // intersections: at the sizes that splats come to, about as many times more as sides are
        // longer.
        grown.small_pixels = std::max(grown.small_pixels, photos_.small_pixels);
        most *= static_cast<std::uint64_t>(held.divisor);
    }
    if (options_.probe_sh)  // what is on trial is to have room, and what follows it
        grown.sh_degree = grown.sh_degree == 0 ? std::min(1, options_.sh_degree)
                                               : predict_degree(options_, options_.iterations);
    grown.room_splats = 0;
    grown.intersections = std::max(4 * grown.splats, most + most / 2);
    grown.intersections += grown.intersections / 2;
    grown.list_segments = counters.longest_list > LIST_SEGMENT ? 2 : photos_.list_segments;
    grown.cooperates = photos_.cooperates || counters.huge_splats > 0;
    grown.densifies = true;
    grown.averages = schedule_.averages();
    return grown;
}

// Of the budget, less what is in use beyond the plan.
std::uint64_t MemoryBudget::bytes_to_plan(const HeldMemory& held) const {
    const std::uint64_t budget = options_.max_memory_bytes.value_or(0);
    const std::uint64_t in_use = device_->allocated_bytes();
    const std::uint64_t planned = plan_memory(*device_, demand(held)).resident();
    const std::uint64_t extra = in_use - std::min(in_use, planned);
    return budget - std::min(budget, extra);
}

std::uint32_t MemoryBudget::splats_within_memory(const HeldMemory& held,
                                                 const TrainCounters& counters) const {
    if (!options_.max_memory_bytes || held.splats == 0) return kNoLimit;
    const std::uint64_t within =
        splats_within(*device_, growth_demand(held, counters), bytes_to_plan(held));
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(within, kNoLimit));
}

std::uint32_t MemoryBudget::growth_limit(const HeldMemory& held, const TrainCounters& counters) {
    within_memory_ = splats_within_memory(held, counters);
    const bool near = counters.most_intersections >
                      kMostIntersections * FrameBuffers::max_intersections(*device_);
    if (near && stopped_by_intersections_ == 0) stopped_by_intersections_ = held.splats;
    limit_ = std::min({options_.max_splats.value_or(kNoLimit), within_memory_,
                       GpuSplats::max_count(*device_, options_.sh_degree, true),
                       near ? held.splats : kNoLimit});
    return limit_;
}

void MemoryBudget::end_round(std::uint32_t splats) {
    if (within_memory_ == limit_ && splats >= within_memory_) stopped_by_memory_ = within_memory_;
}

bool MemoryBudget::has_room_for_round(const HeldMemory& held) const {
    if (!options_.max_memory_bytes) return true;
    return round_peak(*device_, demand(held), held.splats, held.splats) <= bytes_to_plan(held);
}

bool MemoryBudget::has_room_for_degree(const HeldMemory& held, int degree) const {
    if (!options_.max_memory_bytes) return true;
    MemoryDemand wanted = demand(held);
    wanted.sh_degree = degree;
    wanted.averages = schedule_.averages();
    if (held.divisor > 1) wanted.small_pixels = std::max(wanted.small_pixels, photos_.small_pixels);
    return plan_memory(*device_, wanted).total() <= bytes_to_plan(held);
}

}  // namespace darb
