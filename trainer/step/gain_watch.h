// SPDX-License-Identifier: MIT
// GainWatch: whether held-out photos still gain by more iterations, for runs that are to end when
// they do not.
#pragma once

#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "trainer/options/schedule.h"
#include "trainer/step/rank_group.h"

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

}  // namespace darb
