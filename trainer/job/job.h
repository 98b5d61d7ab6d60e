// SPDX-License-Identifier: MIT
// TrainJob: what becomes of a TrainRequest on this data set and device, as data: options, effects
// with their reasons, start, strategy, notes. Nothing here prints; run() trains it.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/plan/effect_plan.h"
#include "trainer/growth/initial_model.h"
#include "trainer/job/request.h"
#include "trainer/run/run.h"

namespace darb {

struct TrainJob {
    TrainRequest request = {};
    TrainOptions options = {};  // request.train with what effects, strategy and start decide
    Dataset dataset = {};
    std::vector<ImageU8> photos = {};  // [view] where the plan had to look at them; else empty
    EffectPlan effects = {};
    std::optional<DenseStart> start = {};    // what stereo found; run() writes it and lets go of it
    std::filesystem::path resume_from = {};  // a checkpoint; empty: the run starts afresh
    std::optional<PaceForecast> pace = {};   // for the time that is left
    // What was decided, one line of text each; may be empty.
    std::string cameras_note = {}, start_note = {}, strategy_note = {}, region_note = {};
    std::vector<std::string> notes = {};  // options that are not used, and why
};

/// Works out what the request means for this data set, except for the splats to start from. photos:
/// one of each view, as load_photos gives them; if empty, they are loaded here when the plan has to
/// look at them. looks: whether it may look; a run in blocks leaves the photos to its parts. Throws
/// Error.
TrainJob resolve(TrainRequest request, Dataset dataset, std::vector<ImageU8> photos = {},
                 bool looks = true);

/// Whether the run begins with points that stereo finds between its photos.
bool starts_from_stereo(const TrainJob& job);

/// Finds these points, which takes a core about a second per photo; `begins` is called first.
/// Throws Error where the request asks for a start that the data set cannot have.
void find_start(Device& device, TrainJob& job, const std::function<void()>& begins = {});

/// Who hears of a run while it trains.
struct JobSinks {
    bool quiet = false;                       // no progress on the terminal
    const std::atomic<bool>* stop = nullptr;  // set by others: the run saves itself and ends
    std::function<LiveAnswer(const LiveStep&)> on_step = {};  // see RunOptions::on_step
    RankGroup ranks = {};                                     // processes that train together
};

/// Trains the job into its output folder; see run_training(). Lets go of the job's photos and
/// start. The caller holds the folder's RunLock.
TrainResult run(Device& device, TrainJob& job, const JobSinks& sinks = {});

/// Everything in one call: loads the data, through COLMAP where photos have no cameras, resolves
/// the request, finds the start and trains, as `darb train` does, but prints nothing. Takes and
/// gives back the RunLock of the output folder. Throws Error.
TrainResult train(Device& device, TrainRequest request, const JobSinks& sinks = {});

/// The options of a run as run_training() takes them, without what is for one run alone.
RunOptions run_options(const TrainJob& job, const JobSinks& sinks);

/// A row for each effect: name, on, overridden, measured, reason.
nlohmann::json plan_json(const EffectPlan& plan);

/// The options as the plan wants them.
void apply_plan(const EffectPlan& plan, TrainOptions& options);

}  // namespace darb
