// The training runs of a comparison, through the code of `darb train`.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "engine/core/error.h"
#include "engine/data/camera_list.h"
#include "tools/darb/compare_flags.h"
#include "tools/darb/device_options.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/run_measurer.h"
#include "tools/darb/train_data.h"
#include "tools/darb/train_run.h"
#include "tools/darb/tune_flags.h"
#include "tools/paper/compare_measure.h"
#include "tools/paper/compare_share.h"
#include "trainer/checkpoint.h"
#include "trainer/run_folder.h"

namespace darb {

namespace {

/// One data set with what its runs share.
class Comparer {
  public:
    Comparer(const CompareFlags& flags, const std::string& name, int kernel, const Lpips* lpips)
        : flags_(flags), name_(name) {
        TrainFlags first = train_flags_of(flags, name, kernel, 0);
        std::optional<RunLock> lock;  // while COLMAP writes
        dataset_ = load_training_data(first, lock);
        print_notes(dataset_.notes);
        if (held_out().empty())
            throw Error(name, "holds no view out", "Give it more photos, or a list of test views.");
        plan_sees_photos_ = !dataset_.points.seen_begin.empty() || dataset_.has_alpha;
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
    void train(TrainFlags& f, const std::atomic<bool>& stop);

    const CompareFlags& flags_;
    std::string name_;
    Dataset dataset_;
    bool plan_sees_photos_ = false;
    std::vector<ImageU8> photos_;
    std::optional<RunMeasurer> measurer_;
};

void Comparer::train(TrainFlags& f, const std::atomic<bool>& stop) {
    if (plan_sees_photos_) f.photos = photos_;  // as the plan of `darb train` sees them
    dataset_.start = {};                        // of the run before
    plan_effects(dataset_, f);
    plan_strategy(dataset_, f);
    f.photos = photos_;
    const RunState state =
        run_state(f.run.output, settings_text(f.train), format_camera_list(dataset_.views),
                  f.train.iterations, held_out().size(), hold_out_text(f.data.held_out));
    const std::string title = fmt::format("{}: {}, seed {}", dataset_name(name_),
                                          kernel_name(f.train.kernel), f.train.seed);
    if (state == RunState::finished) return say_note(title + ": is there");
    if (state == RunState::partial) f.run.resume_from = f.run.output / "checkpoint.darb";
    say_note(title);
    const RunLock lock(f.run.output);
    Device device(
        command_device(flags_.device));  // of its own, so that the peak of memory is this run's
    settle_tuning(device);
    plan_start(device, dataset_, f);
    run_training(device, dataset_, f.train, f.run, &stop, std::move(f.photos));
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
    TrainFlags f = train_flags_of(flags_, name_, kernel, seed);
    ComparedRun run;
    run.kernel = kernel_name(kernel);
    run.seed = seed;
    run.folder = f.run.output;
    try {
        train(f, stop);
        if (stop) run.failure = "interrupted; the same command goes on with it";
        if (!stop) read_run(run, flags_.iterations);
    } catch (const std::exception& e) {
        run.failure = e.what();
        count_exception(e, run);
    }
    if (run.failure.empty())
        measurer_->measure(run);
    else
        read_unfinished_run(run, flags_.iterations, settings_text(f.train),
                            format_camera_list(dataset_.views));
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
