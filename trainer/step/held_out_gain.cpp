// SPDX-License-Identifier: MIT
#include "trainer/step/held_out_gain.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr int kLooksInPatience = 4;
// Less is none: single iterates of one run lie further apart than this.
constexpr double kGainDb = 0.02;

}  // namespace

void check_gain_watch(const Dataset& dataset, const TrainOptions& options, const RankGroup& ranks) {
    if (options.end_without_gain == 0) return;
    const std::string flag = fmt::format("--end-without-gain {}", options.end_without_gain);
    if (ranks.several())
        throw Error(flag,
                    "several ranks train together, and only the first one sees held-out photos",
                    "Leave it out, or train on one rank.");
    if (std::none_of(dataset.views.begin(), dataset.views.end(),
                     [](const View& view) { return view.is_test; }))
        throw Error(flag, "no photo is held out, so nothing tells whether there is a gain",
                    "Add --eval, or leave it out.");
}

GainWatch::GainWatch(const Schedule& schedule)
    : patience_(schedule.options.end_without_gain),
      begin_(schedule.rounds.end),
      end_(schedule.averages() ? schedule.average_begin : schedule.options.iterations) {}

bool GainWatch::is_due(int begin, int iteration) const {
    if (patience_ == 0 || state_.end > 0 || iteration < begin_ || iteration >= end_) return false;
    const int every = std::max(1, patience_ / kLooksInPatience);
    return begin / every != iteration / every;
}

void GainWatch::take_in(const GainLook& look) {
    if (state_.looks.empty() || look.psnr_db >= best_.psnr_db + kGainDb) best_ = look;
    state_.looks.push_back(look);
}

bool GainWatch::add(const GainLook& look) {
    take_in(look);
    return look.iteration - best_.iteration >= patience_;
}

double GainWatch::pace() const {
    double n = 0, mean_x = 0, mean_y = 0;
    for (const GainLook& look : state_.looks)
        if (look.iteration >= best_.iteration)
            ++n, mean_x += look.iteration, mean_y += look.psnr_db;
    if (n < 2) return 0;
    mean_x /= n, mean_y /= n;
    double xy = 0, xx = 0;
    for (const GainLook& look : state_.looks)
        if (look.iteration >= best_.iteration) {
            xy += (look.iteration - mean_x) * (look.psnr_db - mean_y);
            xx += (look.iteration - mean_x) * (look.iteration - mean_x);
        }
    return 1'000 * xy / xx;
}

std::string GainWatch::reason() const {
    return fmt::format(
        "held-out photos have gained less than {} dB since iteration {}, when they were at {:.2f} "
        "dB; at the pace "
        "since then 1,000 more iterations would bring {:+.3f} dB",
        kGainDb, best_.iteration, best_.psnr_db, pace());
}

void GainWatch::restore(const GainState& state) {
    state_ = {};
    for (const GainLook& look : state.looks) take_in(look);
    state_.end = state.end;
}

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
           iteration < schedule_.options.iterations && degree < highest_degree_;
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
