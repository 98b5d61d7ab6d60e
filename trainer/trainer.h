// Trainer: one training run on one device, free of globals. step() records an iteration (forward,
// loss, backward with Adam) and submits it while the one before still runs; the host reads an
// iteration's result after the next is on its way, so nothing waits inside. An iteration whose
// pairs did not fit changes nothing: the buffers grow and it is done again.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "engine/raster/backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/loss.h"
#include "trainer/densify/density_control.h"
#include "trainer/densify/error_score.h"
#include "trainer/densify/mcmc.h"
#include "trainer/densify/morton_order.h"
#include "trainer/exposure.h"
#include "trainer/iterate_average.h"
#include "trainer/memory_plan.h"
#include "trainer/options.h"
#include "trainer/resolution_ramp.h"
#include "trainer/schedule.h"
#include "trainer/smoothing.h"

namespace darb {

/// What one finished iteration tells.
struct IterationResult {
    int iteration = 0;  // from 1
    double loss = 0;
    double psnr_db = 0;  // of the training view
    std::uint32_t splats = 0, visible = 0, pairs = 0;
    std::uint32_t pixels = 0;  // of the photo, at the size of now
    int rest_floats = 0;       // of a splat's harmonics, as buffers hold them
};

/// Counts over the whole run.
struct TrainCounters {
    std::uint64_t redone_iterations = 0, overflows = 0;  // an overflow redoes one or two iterations
    std::uint32_t longest_list = 0;                      // pairs of one tile, most in any frame
    std::uint32_t huge_splats = 0;                       // most in any frame
    std::uint32_t most_pairs = 0;                        // of splats and tiles, most in any frame
    std::uint64_t bad_gradients = 0;
    std::uint64_t cloned_or_split = 0, pruned = 0;     // mcmc: new, moved
    std::array<std::uint64_t, CULL_REASONS> culled{};  // summed over frames, by reason
};

/// Milliseconds of a pass, summed over `iterations`.
struct PassTotal {
    std::string name;
    double ms = 0;
};

/// The frames that training takes.
ForwardOptions forward_options(const TrainOptions& options);

class Trainer {
  public:
    /// photos: as load_photos gives them, in the order of dataset.views. The dataset must outlive
    /// the trainer. scene_extent in world units.
    Trainer(Device& device, const Dataset& dataset, const std::vector<ImageU8>& photos,
            const SplatModel& start, const TrainOptions& options);

    /// Runs iteration `iteration() + 1` and what density control has to do after it. Results of
    /// finished iterations go to on_result, in order, at the latest at drain().
    void step();
    void drain();

    /// Iterations finished or under way.
    int iteration() const { return iteration_; }
    std::uint32_t splat_count() const { return splats_.count(); }
    /// On the device, for work on the same queue between steps; the object stays, its buffers are
    /// replaced by density control.
    const GpuSplats& splats() const { return splats_; }
    int sh_degree() const;  // in use at the current iteration
    /// As a file holds it: the mean where the run has come to it, the smoothing filter worked in.
    /// Drains.
    SplatModel model();

    /// The exposure of each training photo by the view's name; empty where it is off. Drains.
    std::map<std::string, ColourMap> exposures();

    /// What a probe for view-dependent colour found.
    struct Probe {
        int iteration = 0, degree = 0;  // degree: the one on trial
        // On the photos set aside; NaN where nothing was measured: too few photos or a degree above
        // the first, which admits it, or no room for it within max_memory_bytes, which refuses it.
        double gain_db = 0;
        bool admitted = false;
    };
    const std::vector<Probe>& probes() const { return probes_; }

    /// A picture of model(), RGB not clamped. Drains.
    ImageF render(const Camera& camera);
    /// Behind the splats where pictures are compared: black or white.
    glm::vec3 background() const { return background_; }

    std::function<void(const IterationResult&)> on_result;

    const TrainCounters& counters() const { return counters_; }
    std::vector<PassTotal> pass_totals() const { return pass_totals_; }
    std::uint64_t timed_iterations() const { return timed_iterations_; }
    double extent() const { return extent_; }
    /// What the sides of the photos are divided by now: 1 without a resolution ramp.
    int resolution_divisor() const { return divisor_; }
    /// The splats at which TrainOptions::max_memory_bytes stopped the growth; 0: it did not.
    std::uint32_t stopped_by_memory() const { return stopped_by_memory_; }
    /// The same where frames came near the pairs that the device's bindings hold.
    std::uint32_t stopped_by_pairs() const { return stopped_by_pairs_; }
    /// Whether the device had no room for the mean that the run was to end with.
    bool mean_left_out() const { return mean_left_out_; }
    /// What plan_memory() asks for what the trainer holds now.
    MemoryDemand memory_demand() const;
    /// The peak that the plans for all it held so far come to; Device::peak_bytes measures it.
    std::uint64_t planned_bytes() const;

    /// The state beside the model that a checkpoint holds. moments: [attribute][2 N stride].
    struct State {
        int iteration = 0;
        int next_probe = 0;
        std::vector<float> smoothing;     // [N], or empty where the effect is off
        std::vector<float> exposure;      // Exposure::state(), or empty
        std::vector<float> error_shares;  // [N][2] ErrorScore, or empty
        SplatModel model;
        std::vector<std::vector<float>> moments;
        std::vector<float> rest_sum;           // [N][stride of kShRest]; empty where there is none
        std::vector<float> gradient_sum;       // [N][2]
        std::vector<std::vector<float>> mean;  // IterateAverage::state()
        std::uint32_t averaged = 0;            // its count
        TrainCounters counters;
    };
    State state();  // drains
    void restore(const State& state);

  private:
    struct Flight {
        explicit Flight(Device& device);
        Buffer loss;               // gpu::LossResult, host
        Buffer status;             // gpu::FrameStatus, host
        int iteration = 0;         // 0: empty
        std::uint32_t pixels = 0;  // of its photo
        Commands commands;         // last: they are waited for before anything that they use goes
    };
    int view_for(int iteration);
    int degree_at(int iteration) const;
    void reserve_backward();  // as buffers_
    void launch(int iteration);
    void record(Commands& commands, int view, int iteration, int degree, const AdamStep& step,
                const Buffer& loss);
    FrameView frame_view(int view, int degree, const glm::vec3& background) const;
    std::uint32_t photo_of(int view) const;  // its index among the training photos
    void settle_effects(int iteration);
    void update_smoothing();
    void refresh_smoothing();  // where it is stale
    void probe_degree();
    double probe_arm(const State& start, int degree, const std::vector<int>& aside);
    double photo_psnr(int view);
    void set_degree(State& state, int degree);
    gpu::FrameStatus finish(Flight& flight);  // where it overflowed nothing was changed
    void settle(Flight& flight);              // finish, and do again what overflowed
    void density_control(int iteration);
    void make_strategy(const Dataset& dataset);
    DensityResult refine(int iteration, gpu::DensifyArgs args, std::uint32_t limit);
    bool scores(int iteration) const;
    void record_noise(Commands& commands, int iteration);
    void settle_resolution(int iteration);
    void use_whole_photos();
    void use_smaller_photos(int divisor);
    // At the size that the photos have now.
    const gpu::CameraData& camera_data_of(int view) const;
    const Buffer& cameras_now() const;
    const Buffer& pixels_of_photo(int view) const;
    glm::vec3 background_for(int iteration) const;
    MemoryDemand growth_demand() const;
    std::uint64_t bytes_to_plan() const;
    std::uint32_t splats_within_memory() const;
    bool has_room_for_degree(int degree) const;
    void settle_average();
    void settle_order();                    // after a round of density control
    void note_memory();                     // into planned_bytes_, what is held now
    void note_round(std::uint32_t before);  // the same of a round of density control just over
    void check_gradients(int iteration, const gpu::FrameStatus& status) const;
    AdamStep rates(int iteration) const;

    Device* device_;
    TrainOptions options_;
    Schedule schedule_;
    glm::vec3 background_;
    double extent_, reach_;           // of the scene
    std::vector<double> nearest_;     // points, from each camera
    std::vector<std::string> names_;  // of all views
    std::vector<int> train_views_;    // ascending
    std::vector<int> order_;          // of train_views_ in this epoch
    int order_epoch_ = -1;
    int next_probe_;
    std::vector<Probe> probes_;
    std::vector<int> probe_views_;  // not empty while a probe runs: the views it trains on
    float probe_rate_ = 1;          // share of all rates while a probe runs

    GpuSplats splats_;
    FrameBuffers buffers_;
    Forward forward_;
    Backward backward_;
    Loss loss_;
    DensityControl density_;
    std::optional<Mcmc> mcmc_;           // Strategy::mcmc
    std::optional<ErrorScore> score_;    // Strategy::budget
    std::optional<MortonOrder> morton_;  // options.morton_order
    IterateAverage average_;
    bool mean_left_out_ = false;
    bool smoothing_stale_ = true;               // splats came or went
    Buffer train_cameras_;                      // options.antialias
    std::optional<SmoothingFilter> smoothing_;  // options.antialias
    std::optional<Exposure> exposure_;          // options.exposure
    std::vector<gpu::CameraData> camera_data_;
    Buffer cameras_;
    std::vector<Buffer> photos_;  // [view]: uint [H][W], R in the low byte; empty for test views
    std::optional<ResolutionRamp> ramp_;       // options.resolution_ramp, and the next two
    std::vector<Camera> photo_cameras_;        // [view]
    int longest_side_ = 1;                     // px, of all views
    int divisor_ = 1;                          // of the photos' sides, now; above 1 the next three
    std::vector<gpu::CameraData> small_data_;  // [view]
    Buffer small_cameras_;
    std::vector<Buffer> small_photos_;  // [view], as photos_
    Buffer d_image_;
    std::array<Flight, 2> flights_;
    int iteration_ = 0;
    MemoryDemand demand_;  // its photos
    std::array<std::uint64_t, 6> noted_{};
    std::uint64_t planned_bytes_ = 0;
    std::uint32_t stopped_by_memory_ = 0, stopped_by_pairs_ = 0;
    TrainCounters counters_;
    std::vector<PassTotal> pass_totals_;
    std::uint64_t timed_iterations_ = 0;
};

}  // namespace darb
