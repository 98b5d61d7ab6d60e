// The training runs of a comparison, through the code of `darb train`.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/gpu/device_environment.h"
#include "engine/plan/tuner.h"
#include "tools/darb/compare_flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/run_measurer.h"
#include "tools/darb/stop_signals.h"
#include "tools/darb/train_plan.h"
#include "tools/paper/compare_measure.h"
#include "tools/paper/compare_share.h"
#include "trainer/job/job.h"
#include "trainer/job/training_data.h"
#include "trainer/run/run_folder.h"
#include "trainer/step/checkpoint.h"

namespace darb {

namespace {

/// One data set with what its runs share.
class Comparer {
  public:
    Comparer(const CompareFlags& flags, const std::string& name, int kernel, const Lpips* lpips)
        : flags_(flags), name_(name) {
        TrainRequest first = train_request_of(flags, name, kernel, 0);
        std::optional<RunLock> lock;  // while COLMAP writes
        dataset_ = load_training_data(first, lock, {flags.quiet, &stop_on_signals()});
        say_notes(dataset_.notes);
        if (held_out().empty())
            throw Error(name, "holds no view out", "Give it more photos, or a list of test views.");
        photos_ = load_photos(dataset_.views);
        measurer_.emplace(flags, dataset_path(name), dataset_, first, lpips);
    }

    const std::vector<View>& views() const { return dataset_.views; }
    std::string fingerprint() const { return dataset_fingerprint(dataset_, photos_); }
    RunMeasurer& measurer() { return *measurer_; }
    std::vector<View> held_out() const { return held_out_views(dataset_.views); }
    /// Of all runs, by seed and then kernel, those of this rank; up to the stop.
    std::vector<ComparedRun> runs(const std::vector<int>& kernels, const Ranks& ranks,
                                  const std::atomic<bool>& stop);

  private:
    ComparedRun run(int kernel, std::uint64_t seed, const std::atomic<bool>& stop);
    void train(TrainJob& job, const std::atomic<bool>& stop);

    const CompareFlags& flags_;
    std::string name_;
    Dataset dataset_;
    std::vector<ImageU8> photos_;
    std::optional<RunMeasurer> measurer_;
};

void Comparer::train(TrainJob& job, const std::atomic<bool>& stop) {
    job = resolve(job.request, dataset_, photos_);
    const TrainRequest& request = job.request;
    for (const std::string& note : job.notes) say_note("note: " + note);
    const TrainOptions& options = job.options;
    const RunState state =
        run_state(request.output, settings_text(options), format_camera_list(job.dataset.views),
                  options.iterations, held_out().size(), hold_out_text(request.data.held_out));
    const std::string title = fmt::format("{}: {}, seed {}", dataset_name(name_),
                                          kernel_name(options.kernel), options.seed);
    if (state == RunState::finished) return say_note(title + ": is there");
    if (state == RunState::partial) job.resume_from = request.output / "checkpoint.darb";
    say_note(title);
    const RunLock lock(request.output);
    Device device(
        command_device(flags_.device));  // of its own, so that the peak of memory is this run's
    settle_tuning(device);
    find_start(device, job, say_stereo_begins);
    darb::run(device, job, {.quiet = flags_.quiet, .stop = &stop});
}

std::vector<ComparedRun> Comparer::runs(const std::vector<int>& kernels, const Ranks& ranks,
                                        const std::atomic<bool>& stop) {
    std::vector<ComparedRun> done;
    for (int seed = 0, item = 0; seed < flags_.seeds; ++seed)
        for (const int kernel : kernels)
            if (has_turn(ranks, std::size_t(item++)) && !stop)
                done.push_back(run(kernel, static_cast<std::uint64_t>(seed), stop));
    return done;
}

ComparedRun Comparer::run(int kernel, std::uint64_t seed, const std::atomic<bool>& stop) {
    const TrainRequest request = train_request_of(flags_, name_, kernel, seed);
    ComparedRun run;
    run.kernel = kernel_name(kernel);
    run.seed = seed;
    run.folder = request.output;
    TrainJob job{.request = request, .options = request.train};
    job.dataset.views = dataset_.views;
    try {
        train(job, stop);
        if (stop) run.failure = "interrupted; the same command goes on with it";
        if (!stop) read_run(run, flags_.iterations);
    } catch (const std::exception& e) {
        run.failure = e.what();
        count_exception(e, run);
    }
    if (run.failure.empty())
        measurer_->measure(run);
    else
        read_unfinished_run(run, flags_.iterations, settings_text(job.options),
                            format_camera_list(job.dataset.views));
    say_what_went_wrong(run);
    return run;
}

}  // namespace

ComparedDataset compare_on(const CompareFlags& flags, const std::string& dataset,
                           const std::vector<int>& kernels, const Lpips* lpips, Ranks& ranks,
                           const std::atomic<bool>& stop) {
    ComparedDataset result{dataset_name(dataset), dataset, {}};
    std::optional<Comparer> comparer;
    try {
        comparer.emplace(flags, dataset, kernels.front(), lpips);
    } catch (const Error& e) {
        check_same_runs(ranks, flags, dataset, kernels, "", "");
        ComparedRun& failed = result.runs.emplace_back();
        failed.kernel = "every kernel";
        failed.failure = e.what();
        failed.exit_code = 2;
        say_what_went_wrong(failed);
        return result;
    }
    check_same_runs(ranks, flags, dataset, kernels, comparer->fingerprint(),
                    comparer->measurer().measurements());
    refuse_to_overwrite_inputs({flags.json, flags.html}, files_of(comparer->views()));
    const std::vector<ComparedRun> own = comparer->runs(kernels, ranks, stop);
    result.runs = runs_of_all(ranks, own, kernels.size() * static_cast<std::size_t>(flags.seeds));
    for (const ComparedRun& run : result.runs)
        if (std::none_of(own.begin(), own.end(),
                         [&](const ComparedRun& its) { return its.folder == run.folder; }))
            say_what_went_wrong(run);
    if (ranks.is_first() && !stop)
        comparer->measurer().measure_blending(result.runs, comparer->held_out());
    return result;
}

}  // namespace darb
