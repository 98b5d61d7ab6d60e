// SPDX-License-Identifier: MIT
// DegreeProbe: whether colour that changes with the view pays, found out by trying. A probe forks
// the state of a run: some iterations without and with another degree of harmonics, each from the
// same state, compared on training photos that both leave out. Then the run goes on from where it
// was, with the degree that won.
#pragma once

#include <functional>
#include <vector>

#include "trainer/options/schedule.h"
#include "trainer/step/trainer_state.h"

namespace darb {

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
