// SPDX-License-Identifier: MIT
#include "trainer/step/gain_watch.h"

#include <fmt/format.h>

#include <algorithm>

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
      end_(schedule.averages() ? schedule.average_begin : schedule.iterations) {}

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

}  // namespace darb
