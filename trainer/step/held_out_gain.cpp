// SPDX-License-Identifier: MIT
#include "trainer/step/held_out_gain.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "engine/data/metrics.h"

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
constexpr int kBands = 8;
constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

int arm_iterations(const Schedule& schedule) {
    return static_cast<int>(std::lround(kArmIterations / std::sqrt(schedule.speedup)));
}

}  // namespace

ProbeTrial::ProbeTrial(const std::vector<int>& views, int iterations) : iterations_(iterations) {
    if (views.size() < kFewestProbedViews) return;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const bool out = i % kAsideEvery == kAsideEvery / 2 && aside_.size() < kMostAside;
        (out ? aside_ : trained_).push_back(views[i]);
    }
}

double ProbeTrial::gain_db(const TrainerState& without, const TrainerState& with,
                           const ProbeFork& fork) const {
    const double before = train_arm(without, fork);
    return train_arm(with, fork) - before;
}

// Mean PSNR over the photos set aside after some iterations on the others. All rates fall to
// nothing in its second half: what is left to tell the arms apart is not which photo came last.
double ProbeTrial::train_arm(const TrainerState& start, const ProbeFork& fork) const {
    fork.restore(start);
    const long iterations = iterations_;
    for (long i = 0; i < iterations; ++i) {
        const int iteration = start.iteration + 1 + static_cast<int>(i);
        const float share =
            std::min(1.0f, 2 * static_cast<float>(iterations - i) / float(iterations));
        fork.step(iteration, trained_[static_cast<std::size_t>(iteration) % trained_.size()],
                  share);
        if (fork.fit)
            fork.fit(iteration, aside_[static_cast<std::size_t>(iteration) % aside_.size()], share);
    }
    double sum = 0;
    for (const int view : aside_) sum += fork.photo_psnr(view);
    return sum / static_cast<double>(aside_.size());
}

BandError band_error(const ImageF& image, const ImageU8& photo, const glm::vec3& background,
                     bool alpha_is_mask, RowBands bands) {
    const ImageF truth = composite(photo, background);
    BandError error{0, ImageF(image.width, image.height, 3)};
    double count = 0;
    for (int y = 0; y < image.height; ++y) {
        const int band = kBands * y / image.height;
        if (band % 2 != (bands == RowBands::judged ? 1 : 0)) continue;
        for (int x = 0; x < image.width; ++x) {
            const std::size_t p = std::size_t(y) * image.width + x;
            if (alpha_is_mask && photo.data[4 * p + 3] < 128) continue;
            for (std::size_t c = 3 * p; c < 3 * p + 3; ++c) {
                const double off = double(image.data[c]) - truth.data[c];
                error.squared += off * off;
                error.d_image.data[c] = off > 0 ? 1.0f : off < 0 ? -1.0f : 0.0f;
                ++count;
            }
        }
    }
    count = std::max(count, 1.0);
    error.squared /= count;
    for (float& d : error.d_image.data) d /= static_cast<float>(count);
    return error;
}

DegreeProbe::DegreeProbe(const Schedule& schedule)
    : on_(schedule.options.probe_sh),
      highest_degree_(schedule.options.sh_degree),
      schedule_(schedule),
      next_(schedule.degree_interval) {}

int DegreeProbe::iterations(const Schedule& schedule) {
    return 2 * arm_iterations(schedule);
}

bool DegreeProbe::is_due(int iteration, int degree) const {
    return on_ && schedule_.step_begin(iteration) < next_ && next_ <= iteration &&
           iteration < schedule_.options.iterations && degree < highest_degree_;
}

ProbeResult DegreeProbe::run(TrainerState& state, const std::vector<int>& views, bool has_room,
                             const ProbeFork& fork) const {
    const int degree = state.model.sh_degree;
    ProbeResult result{state.iteration, EFFECT_VIEW_COLOUR, degree + 1, kNotMeasured, has_room};
    const ProbeTrial trial(views, arm_iterations(schedule_));
    if (has_room && degree == 0 && trial.is_possible()) {
        TrainerState with = state;
        set_degree(with, degree + 1);
        result.gain_db = trial.gain_db(state, with, fork);
        result.admitted = result.gain_db > 0;
    }
    if (result.admitted) set_degree(state, degree + 1);
    const int interval = schedule_.degree_interval;
    state.next_probe =
        result.admitted ? state.iteration + interval : 2 * std::max(state.iteration, 1);
    // Not while opacities come back from a reset.
    if (state.model.sh_degree == 0 && schedule_.resets_after(state.next_probe))
        state.next_probe += (interval + 1) / 2;
    return result;
}

namespace {

// As a share of the run: late enough for a scene in which rows tell, and so long after the first
// step of a camera.
constexpr double kShutterAt = 0.35, kShutterAfter = 0.1;
constexpr float kShutterArmIterations = 100;  // over the root of Schedule::speedup
// Less is chance: what made sets gained or lost by motion was never nearer to 0 (docs/experiments).
constexpr double kShutterGainDb = 0.05;

int shutter_arm(const Schedule& schedule) {
    return static_cast<int>(std::lround(kShutterArmIterations / std::sqrt(schedule.speedup)));
}

}  // namespace

int ShutterProbe::at(const Schedule& schedule) {
    const TrainOptions& o = schedule.options;
    if (!o.probe_shutter) return 0;
    const double share = std::max(kShutterAt, double{o.camera_from} + kShutterAfter);
    return static_cast<int>(std::lround(share * o.iterations));
}

// Two arms, and between two steps of theirs the fit of a camera, which takes about as long as one.
int ShutterProbe::iterations(const Schedule& schedule) {
    return 4 * shutter_arm(schedule);
}

bool ShutterProbe::is_due(int iteration) const {
    const int due = at(schedule_);
    return due > 0 && schedule_.step_begin(iteration) < due && due <= iteration &&
           iteration < schedule_.options.iterations;
}

ProbeResult ShutterProbe::run(TrainerState& state, const TrainerState& rolling,
                              const std::vector<int>& views, const ProbeFork& fork) const {
    ProbeResult result{state.iteration, EFFECT_SHUTTER, 0, kNotMeasured, false};
    const ProbeTrial trial(views, shutter_arm(schedule_));
    if (trial.is_possible()) {
        result.gain_db = trial.gain_db(state, rolling, fork);
        result.admitted = result.gain_db > kShutterGainDb;
    }
    if (result.admitted) state = rolling;
    return result;
}

}  // namespace darb
