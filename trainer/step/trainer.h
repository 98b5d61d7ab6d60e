// SPDX-License-Identifier: MIT
// Trainer: one training run on one device, free of globals. A loop over parts that know nothing of
// each other: ViewOrder says which view, Schedule and Optimizer at which rates, TrainingStep trains
// on it, a DensityStrategy adds and removes splats between steps. step() submits an iteration while
// the one before still runs; the host reads a result after the next is on its way, so nothing waits
// inside.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/rng.h"
#include "engine/data/dataset.h"
#include "engine/kernels/learned_profile.h"
#include "trainer/growth/density_control.h"
#include "trainer/growth/density_strategy.h"
#include "trainer/step/batch_step.h"
#include "trainer/step/camera_refinement.h"
#include "trainer/step/held_out_gain.h"
#include "trainer/step/memory_plan.h"
#include "trainer/step/optimizer.h"
#include "trainer/step/photos.h"
#include "trainer/step/rank_group.h"
#include "trainer/step/smoothing.h"
#include "trainer/step/step.h"
#include "trainer/step/trainer_state.h"

namespace darb {

class ViewOrder {
  public:
    /// views: at least one.
    ViewOrder(std::vector<int> views, std::uint64_t seed) : views_(std::move(views)), seed_(seed) {}

    /// The view of an iteration, from 1. Any order of calls gives the same answers; those of one
    /// epoch after each other are cheap.
    int view(int iteration) {
        const int count = static_cast<int>(views_.size());
        const int epoch = (iteration - 1) / count;
        if (epoch != epoch_) shuffle(epoch);
        return order_[(iteration - 1) % count];
    }

    /// How many of the iterations 1 to `iteration` have a view for which is_one holds.
    template <class IsOne>
    int visits(int iteration, IsOne is_one) {
        const int last = view(iteration);  // order_ is that of its epoch
        const int count = static_cast<int>(views_.size());
        const auto end = order_.begin() + (iteration - 1) % count;
        return epoch_ * static_cast<int>(std::ranges::count_if(views_, is_one)) +
               static_cast<int>(std::count_if(order_.begin(), end, is_one)) +
               (is_one(last) ? 1 : 0);
    }

  private:
    void shuffle(int epoch) {
        order_ = views_;
        Pcg32 random(seed_, 1000 + static_cast<std::uint64_t>(epoch));
        for (int i = static_cast<int>(order_.size()) - 1; i > 0; --i)
            std::swap(order_[i], order_[random.below(i + 1)]);
        epoch_ = epoch;
    }

    std::vector<int> views_, order_;  // order_: of this epoch
    std::uint64_t seed_;
    int epoch_ = -1;
};

/// What one finished iteration tells.
struct IterationResult {
    int iteration = 0;  // from 1
    double loss = 0;
    double psnr_db = 0;  // for the training view
    std::uint32_t splats = 0, visible = 0, intersections = 0;
    std::uint32_t pixels = 0;  // the photo's, at its current size
    int rest_floats = 0;       // a splat's harmonics, as buffers hold them
    bool ends_step = true;     // false: other views of its batch follow
};

/// A picture in training, as a loss of the caller's sees it; valid during the call.
struct TrainingPicture {
    const ImageF& image;      // [H][W][3] as it is compared with the photo, not clamped
    const ImageU8& photo;     // [H][W][4], at the size that photos have now
    const std::string& name;  // the view's name
    int iteration = 0;        // that this is a step of, from 1
    glm::vec3 background{0.0f};
};

class Trainer {
  public:
    using State = TrainerState;
    using Probe = ProbeResult;

    /// photos: as load_photos gives them, in the order of dataset.views. frozen: of the start, the
    /// first splats that are drawn and not trained (GpuSplats::freeze). ranks: that train
    /// together, each with such a trainer; null: this one alone. Throws Error where the batch has
    /// no equal parts for them.
    Trainer(Device& device, const Dataset& dataset, const std::vector<ImageU8>& photos,
            const SplatModel& start, const Schedule& schedule, RankGroup ranks = {},
            std::uint32_t frozen = 0);
    Trainer(const Trainer&) = delete;
    Trainer& operator=(const Trainer&) = delete;

    /// Runs iteration `iteration() + 1`, or as many as a batch has views, and what density control
    /// has to do before it. Results of finished iterations go to on_result, in order, at the latest
    /// at drain().
    void step();
    void drain() { step_.drain(); }
    std::function<void(const IterationResult&)> on_result;
    /// After each round of density control, with the iteration that it followed. Where it throws,
    /// step() does; it goes on where it stopped.
    std::function<void(int iteration, const DensityResult& result)> on_round;
    /// A loss of the caller's: TrainingStep::picture_gradient. Empty: the built-in one. Where it
    /// throws, step() does, and the iteration is still to be done.
    void set_picture_gradient(std::function<ImageF(const TrainingPicture&)> gradient);

    /// Iterations finished or under way.
    int iteration() const { return iteration_; }
    /// The iteration that the run ends with: that of the options, or sooner after end_early().
    const Schedule& schedule() const { return schedule_; }
    int last_iteration() const { return schedule_.last; }
    /// The run is to end sooner, as Schedule::end_early() has it. Not part of state(): after
    /// restore(), call it again with the same iteration.
    void end_early(int iteration) { schedule_.end_early(iteration); }
    /// Other iterations and limits for the run from now on, as if it had been restored from a
    /// checkpoint under them: what buffers and passes are made for must be the same. Drains.
    void reschedule(const Schedule& next);
    int views_a_step() const { return schedule_.options.batch; }
    std::uint32_t splat_count() const { return splats_.count(); }
    /// On the device, for work on the same queue between steps; the object stays, its buffers are
    /// replaced by density control.
    const GpuSplats& splats() const { return splats_; }
    int sh_degree() const { return degree_at(iteration_); }  // in use at the current iteration
    double extent() const { return extent_; }
    /// Behind the splats where pictures are compared: black or white.
    glm::vec3 background() const {
        return glm::vec3(schedule_.options.white_background ? 1.0f : 0.0f);
    }
    /// KERNEL_* of the splats now, which changes where its profile is learned.
    int kernel() const { return splats_.kernel(); }
    /// Whether the mean that the run is to end with has begun.
    bool averages_now() const { return average_.count() > 0 || mean_left_out_; }
    /// What the sides of the photos are divided by now: 1 without a resolution ramp.
    int resolution_divisor() const { return photos_.divisor(); }
    /// Whether the device had no room for the mean that the run was to end with.
    bool mean_left_out() const { return mean_left_out_; }

    // All of these drain.
    /// As a file holds it: the mean where the run has come to it, the smoothing filter worked in.
    SplatModel model();
    /// A picture of model(), RGB not clamped.
    ImageF render(const Camera& camera);
    /// The exposure of each training view by its name, the same for all faces of a panorama; empty
    /// where it is off.
    std::map<std::string, ColourMap> exposures();
    /// The camera of a view of the data set as training has it now.
    const Camera& camera(std::size_t view) const { return photos_.camera(static_cast<int>(view)); }
    /// The effects of its pictures now, which a probe may have changed.
    const ProjectionEffects& effects() const { return step_.effects(); }
    /// How far cameras have come; nothing where they are not refined.
    std::optional<CameraMoves> camera_moves() const;
    /// The state that a checkpoint holds, the model included.
    State state();
    void restore(const State& state);

    const TrainCounters& counters() const { return totals_.counters; }
    const std::vector<PassTotal>& pass_totals() const { return totals_.passes; }
    std::uint64_t timed_iterations() const { return totals_.timed_iterations; }
    const std::vector<Probe>& probes() const { return probed_; }
    /// What stopped the growth, see MemoryBudget.
    std::uint32_t stopped_by_memory() const { return memory_.stopped_by_memory(); }
    std::uint32_t stopped_by_intersections() const { return memory_.stopped_by_intersections(); }
    /// What plan_memory() asks for what the trainer holds now.
    MemoryDemand memory_demand() const { return memory_.demand(held()); }
    /// The peak that the plans for all it held so far come to; Device::peak_bytes measures it.
    std::uint64_t planned_bytes() const { return memory_.planned_bytes(held()); }

  private:
    int degree_at(int iteration) const;
    glm::vec3 background_for(int iteration) const;
    StepInput input_for(int iteration, int view, int last);
    int exposure_visits(int iteration, std::uint32_t exposure);
    void run_step();
    void run_batch();
    void refine_cameras(int iteration, const std::vector<StepInput>& views,
                        const std::vector<StepOutcome>& outcomes, double share = 1);
    void place_cameras();
    void finish(const StepOutcome& outcome);
    std::optional<DensityResult> control_density();
    DensityResult run_round(int iteration);
    std::vector<std::uint8_t> outside() const;
    std::optional<DensityResult> drop_undrawn();
    DensityResult end_round(const DensityResult& result);
    void open_step();
    void change_kernel();
    void use_kernel(int kernel);
    void restore_profile(const std::vector<float>& state);
    void follow_first();
    gpu::DensifyArgs round_args(int iteration) const;
    void reorder();
    void set_resolution(int iteration);
    void update_smoothing();
    StepInput trial_input(int iteration, int view, float share);
    void train_camera_trial(int iteration, int view, float share);
    StepOutcome band_gradients(StepInput input, RowBands bands, double& squared);
    void fit_camera(int iteration, int view, float share);
    double judged_psnr(int view);
    void fork(const std::function<void(State& tried, ProbeFork fork)>& probe);
    void probe_degree();
    void probe_shutter();
    void average();
    HeldMemory held() const;

    Device* device_;
    OneRank alone_;
    RankGroup ranks_;
    Schedule schedule_;
    double extent_;  // the scene's extent
    bool alpha_is_mask_;
    MemoryBudget memory_;
    GpuSplats splats_;
    TrainingPhotos photos_;
    ViewOrder order_;
    Optimizer optimizer_;
    DensityControl density_;
    std::unique_ptr<DensityStrategy> strategy_;
    std::optional<MortonOrder> morton_;  // options.morton_order
    IterateAverage average_;
    bool mean_left_out_ = false;
    std::optional<TrainedSmoothing> smoothing_;  // options.antialias
    DegreeProbe degree_probe_;
    ShutterProbe shutter_probe_;
    std::vector<Probe> probed_;
    RunTotals totals_;
    int iteration_ = 0;
    struct Turns {                           // the iterations after which these had theirs
        int opened = 0;                      // density control and probes
        int controlled = 0;                  // density control
        std::optional<DensityResult> round;  // its result, still to be reported
    } turns_;
    std::optional<GradientTree> tree_;         // steps_by_views()
    std::optional<CameraRefinement> cameras_;  // options.refine_cameras
    std::optional<ProfileOptimizer> profile_;  // options.learn_kernel
    TrainingStep step_;  // last: it waits for the device before anything that it uses goes
};

}  // namespace darb
