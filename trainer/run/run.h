// SPDX-License-Identifier: MIT
// A whole training run: photos in, output folder out. Folder layout as the ecosystem's viewers
// expect:
//   point_cloud/iteration_N/point_cloud.ply  cameras.json  cfg_args
//   run.jsonl (a line an event)  metrics.json  report.html  held_out/ITERATION/*.png
//   dense_start/ (points.ply and pictures of a dense start)
//   checkpoint.darb
// What an earlier run left there is kept in earlier.1, earlier.2, ...
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/render/cleaning.h"
#include "trainer/options/schedule.h"
#include "trainer/run/progress.h"
#include "trainer/run/run_change.h"
#include "trainer/run/run_report.h"
#include "trainer/step/checkpoint.h"
#include "trainer/step/rank_group.h"
#include "trainer/step/trainer.h"

namespace darb {

/// What a run shows to a live view between two iterations; valid during the call.
struct LiveStep {
    const GpuSplats& splats;  // Trainer::splats
    int iteration = 0, last_iteration = 0;
    const IterationResult& result;  // the latest iteration whose result is known
    const std::vector<Evaluation>& evaluations;
    const TrainOptions& options;           // as they are now
    double seconds_left = 0;               // 0: not known yet
    std::uint64_t memory_bytes = 0;        // of the device, in use
    const std::vector<std::string>& said;  // what became of answers, latest last
};

struct RunOptions {
    std::filesystem::path output;
    std::vector<int> test_iterations, save_iterations, checkpoint_iterations;
    int checkpoint_interval = 1'000;    // refreshes checkpoint.darb; 0: only at the end and Ctrl-C
    std::filesystem::path resume_from;  // empty: start afresh
    bool quiet = false;
    bool report = true;  // report.html at the end
    /// Whether the tuner looks at its record of the device once more, on the splats of this run,
    /// where no run has done so: look_again(). What it finds is for later runs, so that the bits of
    /// this one do not depend on it.
    bool look_again = false;
    /// May be empty. What it held the run up on purpose (a pause) is no training time.
    std::function<LiveAnswer(const LiveStep&)> on_step;
    /// The content of request.json after a change; empty: it stays.
    std::function<std::string(const RunChange&)> changed_request;
    std::optional<PaceForecast> pace;  // for the time that is left, and for the log
    std::string request;               // content of request.json, for --resume; may be empty
    std::string effects;               // the plan in a line, for the log
    std::string effects_json;          // the same as JSON, for metrics.json; may be empty
    CleaningRules cleaning;            // what goes from the scene that is saved at the end
    RankGroup ranks;                   // that train together; the first one writes and talks
    /// Writes into OUT/start what splats start from, once an earlier run is out of the way; may be
    /// empty.
    std::function<void(const std::filesystem::path& folder)> write_start;
    /// What splats start from in place of points, and how many of the first are frozen; null:
    /// initial_model().
    const SplatModel* start = nullptr;
    std::uint32_t frozen = 0;
};

struct TrainResult {
    std::vector<Evaluation> evaluations;
    int iteration = 0;
    bool interrupted = false;
    double seconds = 0;
    // With several ranks, what this process sent in its steps, and how long that and waiting took.
    int trained_steps = 0;
    std::uint64_t sent_bytes = 0;
    double exchange_seconds = 0;
    std::filesystem::path model;  // the last PLY written
    std::string ended_early;      // why the run ended itself; empty: it did not
    // Splats in it, and those that were left out as nothing draws them.
    std::size_t saved = 0, undrawn = 0;
    std::size_t dropped = 0;  // that left the run for the same reason
    std::vector<ReportPicture>
        pictures;  // held-out views beside their photos, of the last evaluation
    std::filesystem::path report;
    std::vector<ReportPass>
        passes;  // mean ms an iteration and share of the roofline, in their order
};

/// The photos as a run trains on them and compares with: without the effect alpha every pixel is
/// opaque. loaded: as load_photos gives them, or none.
std::vector<ImageU8> photos_of_run(const Dataset& dataset, const TrainOptions& options,
                                   std::vector<ImageU8> loaded = {});

/// Trains until options.iterations or until *stop; saves, evaluates and logs as RunOptions says.
/// Progress goes to stderr: a bar on a terminal, plain lines elsewhere. Throws Error; the last
/// checkpoint is then intact, and where the device is not what failed, checkpoint and scene are
/// saved once more as far as they can be. The caller holds the RunLock of the folder.
/// photos: already loaded, in the order of the views; else empty. Once training photos are where
/// steps read them, the run keeps the others alone.
TrainResult run_training(Device& device, const Dataset& dataset, const Schedule& schedule,
                         const RunOptions& run, const std::atomic<bool>* stop = nullptr,
                         std::vector<ImageU8> photos = {});

// What the ranks of a training run share at its start and before each step, and the run of a rank
// that is not the first: it trains, and leaves files and words to that one.

/// The checkpoint that a run goes on from; the file is the first rank's, the others have it from
/// there. Read before the trainer is made: what of the device's tuning changes bits is as the run
/// began with.
std::optional<Checkpoint> checkpoint_of(Device& device, const RunOptions& run);

/// What a Trainer is made with: the start, with the origin of the checkpoint that it will restore,
/// as photos are seen from there. given: what it starts from in place of initial_model().
SplatModel first_model(const Dataset& dataset, const Schedule& schedule,
                       const std::optional<Checkpoint>& checkpoint,
                       const SplatModel* given = nullptr);

/// Throws Error where ranks train other things, or on devices that may round differently.
void check_ranks(const Device& device, const Schedule& schedule, const RankGroup& ranks,
                 const std::string& fingerprint);

/// Before a step, on all ranks: whether any is to stop. Now and then also that they are equal.
bool is_to_stop(Trainer& trainer, const RankGroup& ranks, bool stop);

/// run_training() of another rank than the first.
TrainResult follow_training(Device& device, const Dataset& dataset, const Schedule& schedule,
                            const RunOptions& run, const std::atomic<bool>* stop,
                            std::vector<ImageU8> photos);

}  // namespace darb
