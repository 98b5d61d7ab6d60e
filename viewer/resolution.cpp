#include "viewer/resolution.h"

#include <cstddef>

namespace darb {

namespace {
constexpr int kMemory = 90;        // measurements: three seconds in motion
constexpr double kHelps = 0.9;     // of the time: a step down that saves less is not worth it
constexpr double kReserve = 0.85;  // of the target: room that a step up is taken for
constexpr double kNewWeight = 0.4;
}  // namespace

bool ResolutionControl::known(int step) const {
    return known_[static_cast<std::size_t>(step)].at > count_ - kMemory;
}

void ResolutionControl::measured(double ms) {
    if (!(ms > 0)) return;
    ++count_;
    const auto at = [&](int step) -> Known& { return known_[static_cast<std::size_t>(step)]; };
    Known& here = at(step_);
    here.ms = known(step_) ? here.ms + kNewWeight * (ms - here.ms) : ms;
    here.at = count_;
    if (here.ms <= target_ms_) {
        const bool room = here.ms <= kReserve * target_ms_;
        if (step_ < kSteps && room && (!known(step_ + 1) || at(step_ + 1).ms <= target_ms_))
            ++step_;
    } else if (step_ < kSteps && known(step_ + 1) && here.ms > kHelps * at(step_ + 1).ms) {
        ++step_;  // the step down did not help
    } else if (step_ > 1 && (!known(step_ - 1) || at(step_ - 1).ms < kHelps * here.ms)) {
        --step_;
    }
}

}  // namespace darb
