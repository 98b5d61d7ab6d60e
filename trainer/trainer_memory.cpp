// What the trainer knows of its own device memory: the plan for what it holds now, the peak of the
// plans so far, and how many splats a budget leaves room for.
#include <algorithm>

#include "trainer/forecast.h"
#include "trainer/trainer.h"

namespace darb {

MemoryDemand Trainer::memory_demand() const {
    MemoryDemand demand = demand_;
    const FrameSize& size = buffers_.size();
    demand.splats = splats_.count();
    demand.room_splats = size.splats;
    demand.pairs = size.intersections;
    demand.list_segments = size.list_segments;
    demand.cooperates = size.cooperates;
    demand.sh_degree = splats_.sh_degree();
    demand.densifies = false;
    demand.averages = average_.count() > 0;
    demand.small_pixels = 0;
    for (const Buffer& photo : small_photos_) demand.small_pixels += photo.bytes() / 4;
    demand.small_cameras = static_cast<std::uint32_t>(small_data_.size());
    return demand;
}

// Looked at before each iteration, planned where something has changed.
void Trainer::note_memory() {
    const FrameSize& size = buffers_.size();
    const std::array<std::uint64_t, 6> now{
        splats_.count(),    size.intersections, std::uint64_t(splats_.sh_degree()),
        size.list_segments, size.cooperates,    std::uint64_t(divisor_)};
    if (now == noted_) return;
    noted_ = now;
    planned_bytes_ = std::max(planned_bytes_, plan_memory(*device_, memory_demand()).total());
}

// What a frame works with still has the size from before the round.
void Trainer::note_round(std::uint32_t before) {
    MemoryDemand demand = memory_demand();
    demand.splats = before;
    planned_bytes_ =
        std::max(planned_bytes_, round_peak(*device_, demand, before, splats_.count()));
}

std::uint64_t Trainer::planned_bytes() const {
    return std::max(planned_bytes_, plan_memory(*device_, memory_demand()).total());
}

// Of a frame with half more pairs than the fullest so far, in buffers that grew to half more than
// those. From what a checkpoint holds, not from the size that the buffers came to have: a run that
// is resumed, or shows other pictures meanwhile, has the same limit.
MemoryDemand Trainer::growth_demand() const {
    MemoryDemand demand = memory_demand();
    std::uint64_t most = counters_.most_pairs;
    if (divisor_ > 1) {
        // Photos of the ramp's larger step are still to come, and frames in which a splat has more
        // pairs: at the sizes that splats come to, about as many times more as sides are longer.
        demand.small_pixels = std::max(demand.small_pixels, demand_.small_pixels);
        most *= static_cast<std::uint64_t>(divisor_);
    }
    if (options_.probe_sh)  // what is on trial is to have room, and what follows it
        demand.sh_degree = demand.sh_degree == 0 ? std::min(1, options_.sh_degree)
                                                 : predict_degree(options_, options_.iterations);
    demand.room_splats = 0;
    demand.pairs = std::max(4 * demand.splats, most + most / 2);
    demand.pairs += demand.pairs / 2;
    demand.list_segments = counters_.longest_list > LIST_SEGMENT ? 2 : demand_.list_segments;
    demand.cooperates = demand_.cooperates || counters_.huge_splats > 0;
    demand.densifies = true;
    demand.averages = schedule_.averages();
    return demand;
}

// Of the budget, less what is in use beyond the plan.
std::uint64_t Trainer::bytes_to_plan() const {
    const std::uint64_t in_use = device_->allocated_bytes();
    const std::uint64_t planned = plan_memory(*device_, memory_demand()).resident();
    const std::uint64_t extra = in_use - std::min(in_use, planned);
    return *options_.max_memory_bytes - std::min(*options_.max_memory_bytes, extra);
}

std::uint32_t Trainer::splats_within_memory() const {
    if (!options_.max_memory_bytes || splats_.count() == 0) return 0xFFFFFFFFu;
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(
        splats_within(*device_, growth_demand(), bytes_to_plan()), 0xFFFFFFFFu));
}

bool Trainer::has_room_for_degree(int degree) const {
    if (!options_.max_memory_bytes) return true;
    MemoryDemand demand = memory_demand();
    demand.sh_degree = degree;
    demand.averages = schedule_.averages();
    if (divisor_ > 1) demand.small_pixels = std::max(demand.small_pixels, demand_.small_pixels);
    return plan_memory(*device_, demand).total() <= bytes_to_plan();
}

}  // namespace darb
