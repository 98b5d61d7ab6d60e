// SPDX-License-Identifier: MIT
#include "trainer/step/probe.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace darb {

namespace {

constexpr float kArmIterations = 150;  // over the root of Schedule::speedup
// Fewer photos leave none to set aside: the schedule holds.
constexpr std::size_t kFewestProbedViews = 8;
constexpr std::size_t kAsideEvery = 6, kMostAside = 12;

}  // namespace

int probe_iterations(const Schedule& schedule) {
    return 2 * static_cast<int>(std::lround(kArmIterations / std::sqrt(schedule.speedup)));
}

DegreeProbe::DegreeProbe(const Schedule& schedule)
    : on_(schedule.options.probe_sh),
      highest_degree_(schedule.options.sh_degree),
      schedule_(schedule),
      next_(schedule.degree_interval) {}

bool DegreeProbe::is_due(int iteration, int degree) const {
    return on_ && schedule_.step_begin(iteration) < next_ && next_ <= iteration &&
           iteration < schedule_.iterations && degree < highest_degree_;
}

void DegreeProbe::set_aside(const std::vector<int>& views) {
    trained_.clear();
    aside_.clear();
    for (std::size_t i = 0; i < views.size(); ++i) {
        const bool out = i % kAsideEvery == kAsideEvery / 2 && aside_.size() < kMostAside;
        (out ? aside_ : trained_).push_back(views[i]);
    }
}

// Mean PSNR over the photos set aside after some iterations on the others. All rates fall to
// nothing in its second half: what is left to tell the arms apart is not which photo came last.
double DegreeProbe::train_arm(const TrainerState& start, int degree, const ProbeFork& fork) const {
    TrainerState state = start;
    set_degree(state, degree);
    fork.restore(state);
    const long iterations = probe_iterations(schedule_) / 2;
    for (long i = 0; i < iterations; ++i) {
        const int iteration = start.iteration + 1 + static_cast<int>(i);
        const float share =
            std::min(1.0f, 2 * static_cast<float>(iterations - i) / float(iterations));
        fork.step(iteration, trained_[static_cast<std::size_t>(iteration) % trained_.size()],
                  share);
    }
    double sum = 0;
    for (const int view : aside_) sum += fork.photo_psnr(view);
    return sum / static_cast<double>(aside_.size());
}

void DegreeProbe::run(TrainerState& state, const std::vector<int>& views, bool has_room,
                      const ProbeFork& fork) {
    const int degree = state.model.sh_degree;
    ProbeResult result{state.iteration, degree + 1, std::numeric_limits<double>::quiet_NaN(),
                       has_room};
    if (has_room && degree == 0 && views.size() >= kFewestProbedViews) {
        set_aside(views);
        const double without = train_arm(state, degree, fork);
        result.gain_db = train_arm(state, degree + 1, fork) - without;
        result.admitted = result.gain_db > 0;
    }
    if (result.admitted) set_degree(state, degree + 1);
    const int interval = schedule_.degree_interval;
    state.next_probe =
        result.admitted ? state.iteration + interval : 2 * std::max(state.iteration, 1);
    // Not while opacities come back from a reset.
    if (state.model.sh_degree == 0 && schedule_.resets_after(state.next_probe))
        state.next_probe += (interval + 1) / 2;
    results_.push_back(result);
}

}  // namespace darb
