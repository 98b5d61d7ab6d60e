#include "trainer/totals.h"

#include <algorithm>

#include "engine/core/error.h"

namespace darb {

namespace {
// More splats than this share with a gradient that is not finite: something is broken.
constexpr std::uint64_t kBadGradientShare = 1'000;
}  // namespace

void RunTotals::count(const StepOutcome& outcome) {
    const gpu::FrameStatus& status = outcome.status;
    counters.redone_iterations += outcome.redone;
    counters.overflows += outcome.overflows;
    for (size_t r = 0; r < counters.culled.size(); ++r) counters.culled[r] += status.culled[r];
    counters.bad_gradients += status.bad_gradients;
    counters.longest_list = std::max(counters.longest_list, status.longest_list);
    counters.huge_splats = std::max(counters.huge_splats, status.huge_splats);
    counters.most_intersections = std::max(counters.most_intersections, status.intersections);
}

void RunTotals::add_times(const StepOutcome& outcome) {
    for (const PassTime& pass : outcome.passes) {
        const auto known = std::find_if(passes.begin(), passes.end(),
                                        [&](const PassTotal& p) { return p.name == pass.name; });
        if (known == passes.end())
            passes.push_back({pass.name, pass.ms});
        else
            known->ms += pass.ms;
    }
    ++timed_iterations;
}

void check_gradients(const StepOutcome& outcome, std::uint32_t splat_count) {
    const std::uint64_t bad = outcome.status.bad_gradients;
    const std::uint64_t splats = std::max<std::uint64_t>(splat_count, kBadGradientShare);
    if (bad * kBadGradientShare <= splats) return;
    throw Error(fmt::format("iteration {}", outcome.iteration),
                fmt::format("the gradients of {} of {} splats are not finite, more than 1 in {}",
                            bad, splat_count, kBadGradientShare),
                "The last checkpoint is intact. Check the device (darb check), then the photos and "
                "the learning rates.");
}

}  // namespace darb
