// SPDX-License-Identifier: MIT
// What photos that are not trained on say about a run. GainWatch: whether held-out photos still
// gain by more iterations, for runs that are to end when they do not. Probes: whether an effect
// pays.
#pragma once

#include <functional>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "shaders/shared/effect_list.h"
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

// Probes: whether an effect pays, found out by trying. A probe forks the state of a run: some
// iterations without and with the effect, each from the same state, compared on training photos
// that both leave out. Then the run goes on from where it was, with the effect if it won.

/// What a probe found.
struct ProbeResult {
    int iteration = 0;
    int effect = EFFECT_VIEW_COLOUR;  // EFFECT_VIEW_COLOUR or EFFECT_SHUTTER
    int degree = 0;                   // of EFFECT_VIEW_COLOUR: the one on trial
    // Gain on the photos set aside. NaN where nothing was measured: with too few photos or a degree
    // above the first a degree is admitted and a shutter is not; without room for it within
    // max_memory_bytes a degree is refused.
    double gain_db = 0;
    bool admitted = false;
};

/// What a probe asks of the run that it forks.
struct ProbeFork {
    /// The run goes on from this state.
    std::function<void(const TrainerState& state)> restore;
    /// Trains iteration `iteration` on a view, all rates times `share`, nothing else.
    std::function<void(int iteration, int view, float share)> step;
    /// Fits what belongs to a photo set aside alone, and nothing else, between two steps; empty:
    /// there is nothing of the kind.
    std::function<void(int iteration, int view, float share)> fit;
    /// PSNR of the picture of a training view as it is now, dB.
    std::function<double(int view)> photo_psnr;
};

/// Two arms of the same iterations from the same iteration of a run.
class ProbeTrial {
  public:
    /// views: the training views, of which some are set aside. iterations: of an arm.
    ProbeTrial(const std::vector<int>& views, int iterations);

    /// Whether there are enough photos to set some aside.
    bool is_possible() const { return !aside_.empty(); }
    /// Mean PSNR on the photos set aside after the arm that begins with `with`, minus that after
    /// the arm that begins with `without`. The fork ends away from the run's state.
    double gain_db(const TrainerState& without, const TrainerState& with,
                   const ProbeFork& fork) const;

  private:
    double train_arm(const TrainerState& start, const ProbeFork& fork) const;

    int iterations_;
    std::vector<int> trained_, aside_;  // views
};

/// What a camera is fitted to and what judges it: the rows of a picture in eight bands, every other
/// one of either.
enum class RowBands { fitted, judged };

/// The error of a picture in such bands.
struct BandError {
    double squared = 0;  // mean of the squared error
    ImageF d_image;      // [H][W][3], gradient of the mean absolute error
};

/// image: RGB, not clamped. photo: RGBA of the same size, compared as over this background. Pixels
/// of alpha below 128 do not count where alpha is a mask.
BandError band_error(const ImageF& image, const ImageU8& photo, const glm::vec3& background,
                     bool alpha_is_mask, RowBands bands);

// DegreeProbe: whether colour that changes with the view pays.

class DegreeProbe {
  public:
    explicit DegreeProbe(const Schedule& schedule);

    /// Iterations that one probe takes beside those of the run.
    static int iterations(const Schedule& schedule);
    /// Whether a probe is due after the step that ends with this iteration, for splats of this
    /// degree.
    bool is_due(int iteration, int degree) const;
    /// Tries one more degree. state: the run's, which the fork ends away from; it gets the degree
    /// that won and the iteration of the next probe, for the caller to restore. views: the training
    /// views. has_room: for one more degree.
    ProbeResult run(TrainerState& state, const std::vector<int>& views, bool has_room,
                    const ProbeFork& fork) const;

    /// Another schedule of the same run from now on; next() stays.
    void set_schedule(const Schedule& schedule) { schedule_ = schedule; }
    int next() const { return next_; }
    /// 0 leaves it as it is.
    void set_next(int iteration) {
        if (iteration > 0) next_ = iteration;
    }

  private:
    bool on_;
    int highest_degree_;
    Schedule schedule_;
    int next_;
};

// ShutterProbe: whether the rows of photos were exposed one after the other, where cameras are
// refined and no file says it. There is one such probe in a run.

class ShutterProbe {
  public:
    explicit ShutterProbe(const Schedule& schedule) : schedule_(schedule) {}

    /// The iteration after which a run tries; 0: it never does.
    static int at(const Schedule& schedule);
    /// Iterations that the probe takes beside those of the run.
    static int iterations(const Schedule& schedule);
    /// Whether it is due after the step that ends with this iteration.
    bool is_due(int iteration) const;
    /// state: the run's, which the fork ends away from; it becomes `rolling`, the same with
    /// shutters that are trained, where that won, for the caller to restore. views: the training
    /// views.
    ProbeResult run(TrainerState& state, const TrainerState& rolling, const std::vector<int>& views,
                    const ProbeFork& fork) const;

    /// Another schedule of the same run from now on.
    void set_schedule(const Schedule& schedule) { schedule_ = schedule; }

  private:
    Schedule schedule_;
};

}  // namespace darb
