// SPDX-License-Identifier: MIT
// GainWatch: whether held-out photos still gain by more iterations, for runs that are to end when
// they do not.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "trainer/options/schedule.h"
#include "trainer/step/rank_group.h"
#include "trainer/step/trainer_state.h"

namespace darb {

/// The held-out photos after an iteration.
struct GainLook {
    int iteration = 0;
    double psnr_db = 0;
};

/// What a watch knows, as a checkpoint holds it.
struct GainState {
    std::vector<GainLook> looks;  // in their order
    int end = 0;                  // where the run is to end; 0: where its options say
};

/// Throws Error where the options ask for a watch that this run cannot have: no photo is held out,
/// or several ranks train together, of which only the first one looks.
void check_gain_watch(const Dataset& dataset, const TrainOptions& options, const RankGroup& ranks);

class GainWatch {
  public:
    /// options.end_without_gain iterations without a gain end a run; 0: it never looks.
    explicit GainWatch(const Schedule& schedule);

    /// Whether photos are to be looked at after the step that did the iterations (begin,
    /// iteration]: four times in as many iterations as may go without a gain, between the end of
    /// growth and the mean that a run ends with.
    bool is_due(int begin, int iteration) const;

    /// Takes in what a look found. True where nothing was gained for so long.
    bool add(const GainLook& look);

    /// The look with the highest PSNR that was a gain when it came. There must be one.
    const GainLook& best() const { return best_; }
    /// dB in 1,000 iterations, over the looks since the best one: the slope of a line through them.
    double pace() const;
    /// Why the run ends, in a sentence.
    std::string reason() const;

    const GainState& state() const { return state_; }
    void restore(const GainState& state);
    void set_end(int iteration) { state_.end = iteration; }

  private:
    void take_in(const GainLook& look);

    int patience_, begin_, end_;
    GainState state_;
    GainLook best_;
};

// DegreeProbe: whether colour that changes with the view pays, found out by trying. A probe forks
// the state of a run: some iterations without and with another degree of harmonics, each from the
// same state, compared on training photos that both leave out. Then the run goes on from where it
// was, with the degree that won.

/// What a probe found.
struct ProbeResult {
    int iteration = 0, degree = 0;  // degree: the one on trial
    // Gain on the photos set aside. NaN where nothing was measured: with too few photos or a degree
    // above the first it is admitted, without room for it within max_memory_bytes it is refused.
    double gain_db = 0;
    bool admitted = false;
};

/// What a probe asks of the run that it forks.
struct ProbeFork {
    /// The run goes on from this state.
    std::function<void(const TrainerState& state)> restore;
    /// Trains iteration `iteration` on a view, all rates times `share`, nothing else.
    std::function<void(int iteration, int view, float share)> step;
    /// PSNR of the picture of a training view as it is now, dB.
    std::function<double(int view)> photo_psnr;
};

/// Iterations that one probe takes beside those of the run.
int probe_iterations(const Schedule& schedule);

class DegreeProbe {
  public:
    explicit DegreeProbe(const Schedule& schedule);

    /// Whether a probe is due after the step that ends with this iteration, for splats of this
    /// degree.
    bool is_due(int iteration, int degree) const;
    /// Tries one more degree. state: the run's, which the fork ends away from; it gets the degree
    /// that won and the iteration of the next probe, for the caller to restore. views: the training
    /// views. has_room: for one more degree.
    void run(TrainerState& state, const std::vector<int>& views, bool has_room,
             const ProbeFork& fork);

    /// Another schedule of the same run from now on; next() stays.
    void set_schedule(const Schedule& schedule) { schedule_ = schedule; }
    const std::vector<ProbeResult>& results() const { return results_; }
    int next() const { return next_; }
    /// 0 leaves it as it is.
    void set_next(int iteration) {
        if (iteration > 0) next_ = iteration;
    }

  private:
    double train_arm(const TrainerState& start, int degree, const ProbeFork& fork) const;
    void set_aside(const std::vector<int>& views);

    bool on_;
    int highest_degree_;
    Schedule schedule_;
    int next_;
    std::vector<int> trained_, aside_;  // views
    std::vector<ProbeResult> results_;
};

}  // namespace darb
