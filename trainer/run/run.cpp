// SPDX-License-Identifier: MIT
#include "trainer/run/run.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/memory.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/data/run_events.h"
#include "engine/kernels/kernel_definition.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/learned_profile.h"
#include "engine/plan/tuner.h"
#include "engine/raster/frame_view.h"
#include "engine/render/cleaning.h"
#include "engine/render/free_space.h"
#include "engine/render/renderer.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/ply.h"
#include "trainer/growth/initial_model.h"
#include "trainer/run/forecast.h"
#include "trainer/run/progress.h"
#include "trainer/run/run_folder.h"
#include "trainer/run/run_log.h"
#include "trainer/run/run_report.h"
#include "trainer/step/checkpoint.h"
#include "trainer/step/held_out_gain.h"

namespace darb {

namespace {

using Clock = std::chrono::steady_clock;

// Iterations until the splats are like those of a trained scene, and the card is warm.
constexpr int kLooksAgainAt = 200;

// Whether the list has an iteration of (begin, end].
bool contains(const std::vector<int>& list, int begin, int end) {
    return std::any_of(list.begin(), list.end(), [&](int i) { return begin < i && i <= end; });
}

// Measured before there is a budget of memory, and no part of the run's peak.
DeviceRates rates_of(Device& device) {
    const DeviceRates rates = measure_rates(device);
    device.forget_peak();
    return rates;
}

// Said once, by the first of several ranks, which all have the same photos.
std::vector<ImageU8> with_doubts(const Dataset& dataset, std::vector<ImageU8> photos) {
    for (const std::string& doubt : photo_doubts(dataset, photos))
        say("warning: {}: {}\n", dataset.root.string(), doubt);
    return photos;
}

// One run: the loop and what it writes. The stopwatch counts training alone.
class Run {
  public:
    Run(Device& device, const Dataset& dataset, const Schedule& schedule, const RunOptions& run,
        std::vector<ImageU8> photos)
        : device_(device),
          dataset_(dataset),
          schedule_(schedule),
          run_(run),
          photos_(
              with_doubts(dataset, photos_of_run(dataset, schedule.options, std::move(photos)))),
          fingerprint_(dataset_fingerprint(dataset, photos_)),
          rates_(rates_of(device)),
          tuning_(result_tuning(device)),
          checkpoint_(checkpoint_of(device, run)),
          trainer_(while_doing("the splats of the start",
                               [&] {
                                   return Trainer(
                                       device, dataset, photos_,
                                       first_model(dataset, schedule, checkpoint_, run.start),
                                       schedule, run.ranks, run.frozen);
                               })),
          watch_(schedule),
          log_(run.output),
          progress_(1, schedule.options.iterations, run.quiet) {
        for (std::size_t i = 0; i < photos_.size(); ++i)  // the others are where steps read them
            if (!dataset.views[i].is_test) photos_[i] = {};
        give_back_freed_memory();
    }

    TrainResult execute(const std::atomic<bool>* stop);

  private:
    void resume();
    void on_result(const IterationResult& result);
    void evaluate(int iteration);
    std::filesystem::path model_path(int iteration) const {
        return run_.output / "point_cloud" / fmt::format("iteration_{}", iteration) /
               "point_cloud.ply";
    }
    void save_model(int iteration);
    void clean(int iteration, SplatModel& model);
    void leave_out(int iteration, const Clutter& clutter, SplatModel& model);
    void write_cameras();
    void write_kernel();
    void show_step();
    void change(const RunChange& change);
    void measure_now();
    void save_now();
    void tell(const std::string& what);
    void save_checkpoint(const std::filesystem::path& path);
    void begin();
    void train(const std::atomic<bool>* stop);
    void after_step(int begin);
    void look_for_gain(int iteration);
    void save_what_is_there(bool failed);
    bool is_finished() const;
    TrainResult finished();
    std::string other_way() const;
    void report_troubles();
    void report_resolution();
    void report_memory();
    /// With the effects that a probe admitted.
    TrainOptions options_now() const {
        TrainOptions options = schedule_.options;
        options.projection.shutter = trainer_.effects().shutter;
        return options;
    }
    void report_probes();
    void look_at_forms();
    void report_cameras();
    void report_kernel();
    double seconds() const {
        return seconds_ +
               (running_ ? std::chrono::duration<double>(Clock::now() - started_).count() : 0);
    }
    void stopwatch(bool run) {
        seconds_ = seconds();
        running_ = run;
        started_ = Clock::now();
    }

    Device& device_;
    const Dataset& dataset_;
    Schedule schedule_;
    const RunOptions& run_;
    std::vector<ImageU8> photos_;  // [view]; while it trains of held-out views alone
    const std::string fingerprint_;
    const DeviceRates rates_;
    const std::string tuning_;              // this device's, before the checkpoint's is used
    std::optional<Checkpoint> checkpoint_;  // to go on with, until resume()
    Trainer trainer_;
    GainWatch watch_;
    RunLog log_;
    Progress progress_;
    TrainResult summary_;
    std::optional<PaceForecast> pace_;
    std::vector<std::string> said_;  // to a live view
    bool stops_ = false;             // a live view asked for it
    IterationResult latest_;
    size_t told_probes_ = 0;
    std::uint32_t told_by_memory_ = 0,
                  told_by_intersections_ = 0;  // the splats at which growth stopped
    bool told_no_mean_ = false;
    bool looked_at_forms_ = false;
    int told_divisor_ = 1;
    bool whole_ = false;  // between two iterations, when the splats can be saved
    double seconds_ = 0;
    bool running_ = false;
    Clock::time_point started_;
};

// Whether the run that wrote a checkpoint is the one that the folder holds.
bool is_own(const std::filesystem::path& checkpoint, const std::filesystem::path& output) {
    std::error_code none;
    const std::filesystem::path folder = std::filesystem::absolute(checkpoint).parent_path();
    return !checkpoint.filename().string().starts_with("earlier.") &&
           std::filesystem::equivalent(folder, output, none);
}

void Run::resume() {
    const Checkpoint checkpoint = std::move(checkpoint_.value());
    checkpoint_.reset();
    check_resumable(checkpoint, run_.resume_from, schedule_, dataset_, fingerprint_);
    trainer_.restore(checkpoint.state);
    watch_.restore(checkpoint.gain);
    if (watch_.state().end > 0) {
        trainer_.end_early(watch_.state().looks.back().iteration);
        summary_.ended_early = watch_.reason();
    }
    told_divisor_ = trainer_.resolution_divisor();
    seconds_ = checkpoint.seconds;
    const bool own = is_own(run_.resume_from, run_.output);
    if (!own) set_aside(run_.output);
    own ? log_.go_on(checkpoint.state.iteration) : log_.begin();
    progress_ = Progress(checkpoint.state.iteration + 1, schedule_.options.iterations, run_.quiet);
    progress_.note(fmt::format("resumed {} at iteration {}", run_.resume_from.string(),
                               checkpoint.state.iteration));
    if (checkpoint.tuning != tuning_)
        progress_.note(fmt::format("goes on with {} as it began; {} is for a run that starts again",
                                   checkpoint.tuning, tuning_));
}

// As 3DGS writes it: name -> three rows of four.
std::string exposure_text(const std::map<std::string, ColourMap>& maps) {
    nlohmann::json all = nlohmann::json::object();
    for (const auto& [name, map] : maps)
        for (size_t r = 0; r < 3; ++r)
            all[name].push_back(std::vector<float>(map.begin() + std::ptrdiff_t(4 * r),
                                                   map.begin() + std::ptrdiff_t(4 * r + 4)));
    return all.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

void Run::on_result(const IterationResult& result) {
    latest_ = result;
    log_.iteration(result, trainer_.counters(), seconds(), trainer_.pass_totals());
    if (result.ends_step) progress_.update(result, device_);
}

void Run::evaluate(int iteration) {
    stopwatch(false);
    Evaluation evaluation = evaluate_held_out(trainer_, dataset_, photos_);
    if (evaluation.views.empty()) return stopwatch(true);  // nothing is held out
    evaluation.iteration = iteration;
    evaluation.seconds = seconds_;
    evaluation.splats = trainer_.splat_count();
    const auto folder = run_.output / "held_out" / std::to_string(iteration);
    const auto files = write_side_by_side(trainer_, dataset_, photos_, folder);
    summary_.pictures.clear();
    for (size_t v = 0; v < files.size(); ++v)
        summary_.pictures.push_back({evaluation.views[v].name, files[v],
                                     evaluation.views[v].psnr_db, evaluation.views[v].ssim});
    progress_.note(
        fmt::format("iteration {}: held-out PSNR {:.2f} dB, SSIM {:.4f} over {} views, {} splats",
                    iteration, evaluation.psnr_db, evaluation.ssim,
                    evaluation.views.size() - (evaluation.arc ? evaluation.arc->views : 0),
                    count_text(evaluation.splats)));
    if (const auto& arc = evaluation.arc)
        progress_.note(fmt::format("the arc: PSNR {:.2f} dB, SSIM {:.4f} over {} views",
                                   arc->psnr_db, arc->ssim, arc->views));
    log_.evaluation(evaluation);
    summary_.evaluations.push_back(std::move(evaluation));
    stopwatch(true);
}

void Run::save_model(int iteration) {
    stopwatch(false);
    summary_.model = model_path(iteration);
    SplatModel model = trainer_.model();
    model.metres_per_unit = dataset_.metres_per_unit;
    model.place = dataset_.place;
    if (const std::size_t lost = drop_non_finite(model); lost > 0)
        progress_.warn(fmt::format("{} splats with NaN or infinity are left out of {}", lost,
                                   summary_.model.string()));
    // Those that are frozen keep their numbers, by which they are taken out again.
    const std::size_t all = model.size();
    summary_.undrawn = drop_undrawn(schedule_.undrawn_opacity, run_.frozen, model);
    if (run_.cleaning.any() && iteration == trainer_.last_iteration()) clean(iteration, model);
    summary_.saved = model.size();
    if (summary_.undrawn > 0)
        progress_.note(
            fmt::format("{} of {} splats are too transparent to be drawn and are left out of {}",
                        count_text(summary_.undrawn), count_text(all), summary_.model.string()));
    if (model.size() == 0)
        progress_.warn("no splat is left: " + summary_.model.string() + " is empty");
    while_doing(summary_.model.string(), [&] { write_ply(summary_.model, model); });
    if (const auto maps = trainer_.exposures(); !maps.empty())
        write_file_atomic(run_.output / "exposure.json", exposure_text(maps));
    if (trainer_.camera_moves()) write_cameras();
    if (schedule_.options.learn_kernel > 0) write_kernel();
    stopwatch(true);
}

// By the cameras of the training photos, as they are trained now.
void Run::clean(int iteration, SplatModel& model) {
    std::vector<Camera> cameras;
    for (std::size_t v = 0; v < dataset_.views.size(); ++v)
        if (!dataset_.views[v].is_test) cameras.push_back(trainer_.camera(v));
    try {
        const Clutter clutter =
            find_clutter(device_, model, evenly_chosen(cameras), run_.cleaning, [&] {
                const TrainOptions& o = options_now();
                return std::make_unique<Renderer>(device_, model, Accuracy{}, o.projection,
                                                  o.huge_splat_path);
            });
        leave_out(iteration, clutter, model);
    } catch (const NoRoom&) {
        progress_.warn(
            "the scene is not cleaned: the device has no memory for that beside the run; darb "
            "clean does it afterwards");
    }
}

void Run::leave_out(int iteration, const Clutter& clutter, SplatModel& model) {
    const auto tell = [&](const ClutterOfRule& rule) {
        progress_.note(fmt::format("cleaning, {}: {} of {} splats, {:.2f} % of the light",
                                   rule.rule, count_text(count_of(rule.set)),
                                   count_text(rule.set.size()), 100 * rule.light));
    };
    for (const ClutterOfRule& rule : clutter.rules) tell(rule);
    if (clutter.rules.size() > 1) tell(clutter.together);
    const SplatSet& goes = clutter.together.set;
    if (count_of(goes) == goes.size())
        return progress_.warn("the scene is not cleaned: nothing would be left of it");
    keep_splats([&](std::size_t i) { return goes[i] == 0; }, model);
    ForwardOptions pictures = forward_options(options_now());
    pictures.store_for_backward = pictures.depth_sum = pictures.depth_spread = false;
    Renderer renderer(device_, model, pictures);
    const Evaluation after =
        evaluate_held_out(trainer_, dataset_, photos_, [&](const Camera& camera) {
            return renderer.render(camera, trainer_.background(), trainer_.sh_degree());
        });
    const double none = std::numeric_limits<double>::quiet_NaN();
    const std::vector<Evaluation>& before = summary_.evaluations;
    const bool measured = !after.views.empty() && !before.empty();
    if (measured)
        progress_.note(fmt::format("cleaning: held-out PSNR {:.2f} dB before, {:.2f} dB after",
                                   before.back().psnr_db, after.psnr_db));
    log_.cleaned(iteration, clutter, measured ? before.back().psnr_db : none,
                 measured ? after.psnr_db : none);
}

// A file for --kernel-file.
void Run::write_kernel() {
    const KernelDefinition* learned = kernel_definition(trainer_.kernel());
    DARB_CHECK(learned != nullptr, "kernel {}", trainer_.kernel());
    write_file_atomic(run_.output / "kernel.json", definition_json(*learned).dump(1) + "\n");
}

// As they are trained now.
void Run::write_cameras() {
    std::vector<View> views = dataset_.views;
    for (size_t v = 0; v < views.size(); ++v) views[v].camera = trainer_.camera(v);
    write_camera_list(run_.output / "cameras.json", views);
}

void Run::save_checkpoint(const std::filesystem::path& path) {
    stopwatch(false);
    write_checkpoint(path, {trainer_.state(), settings_text(schedule_), fingerprint_, seconds_,
                            result_tuning(device_), watch_.state()});
    stopwatch(true);
}

// The stopwatch counts what the view draws, which shares the device, and no pause.
void Run::show_step() {
    for (bool again = true; again && !stops_;) {
        const LiveAnswer answer = run_.on_step(
            {trainer_.splats(), trainer_.iteration(), schedule_.options.iterations, latest_,
             summary_.evaluations, schedule_.options, progress_.seconds_left(trainer_.iteration()),
             device_.allocated_bytes(), said_});
        seconds_ -= answer.paused_s;
        progress_.leave_out(answer.paused_s);
        for (const RunChange& wanted : answer.changes) change(wanted);
        if (trainer_.iteration() < trainer_.last_iteration()) {  // else both follow anyway
            if (answer.measures) measure_now();
            if (answer.saves) save_now();
        }
        stops_ = answer.stops;
        again = answer.again;
    }
}

void Run::measure_now() {
    const bool known = !summary_.evaluations.empty() &&
                       summary_.evaluations.back().iteration == trainer_.iteration();
    if (!known) evaluate(trainer_.iteration());
}

void Run::tell(const std::string& what) {
    progress_.note(what);
    said_.push_back(what);
}

// Checkpoint and request change together, so that a run that is resumed knows the settings.
void Run::change(const RunChange& wanted) {
    const TrainOptions before = schedule_.options;
    std::string refusal =
        change_refusal(wanted, before,
                       {trainer_.iteration(), trainer_.averages_now(),
                        !summary_.ended_early.empty(), run_.ranks.several(), device_.peak_bytes()});
    TrainOptions options = before;
    apply_change(wanted, options);
    const std::string text = change_text(before, options);
    if (refusal.empty() && text.empty()) refusal = "Nothing of it is other than it was.";
    std::optional<Schedule> next;
    if (refusal.empty()) try {
            next.emplace(options);
        } catch (const Error& e) {
            refusal = e.what();
        }
    if (!next) return tell("not changed: " + refusal);
    trainer_.reschedule(*next);
    schedule_ = *next;
    save_checkpoint(run_.output / "checkpoint.darb");
    if (run_.changed_request)
        write_file_atomic(run_.output / "request.json", run_.changed_request(wanted));
    log_.changed(trainer_.iteration(), text, schedule_);
    progress_.set_last(schedule_.options.iterations);
    if (pace_) progress_.expect(schedule_, *pace_);
    tell(fmt::format("after iteration {}: {}", trainer_.iteration(), text));
}

void Run::save_now() {
    save_checkpoint(run_.output / "checkpoint.darb");
    save_model(trainer_.iteration());
    tell(fmt::format("iteration {}: saved the checkpoint and {}", trainer_.iteration(),
                     summary_.model.string()));
}

// Whether metrics.json is that of a whole run, which nothing is to be added to.
bool Run::is_finished() const {
    const std::filesystem::path path = run_.output / "metrics.json";
    if (trainer_.iteration() < trainer_.last_iteration() || !std::filesystem::exists(path))
        return false;
    const RunEnd end = read_run_end(path);
    return !end.interrupted && end.iteration == trainer_.last_iteration();
}

// Nothing is left to do but a report that could not be written then.
TrainResult Run::finished() {
    progress_.note("the run is finished: nothing is left to do");
    if (run_.report && !std::filesystem::exists(run_.output / "report.html"))
        summary_.report = log_.report_again();
    summary_.iteration = trainer_.iteration();
    summary_.seconds = seconds_;
    return summary_;
}

void Run::begin() {
    check_ranks(device_, schedule_, run_.ranks, fingerprint_);
    remove_leftovers(run_.output);
    if (!run_.resume_from.empty()) {
        resume();  // before anything of an earlier run is moved: it may be refused
    } else {
        set_aside(run_.output);
        log_.begin();
        if (const TrainOptions& o = schedule_.options; o.learn_kernel > 0)
            progress_.note(fmt::format(
                "the kernel's profile is learned; where it starts, it differs from {} by "
                "{:.4f} at most",
                kernel_name(o.kernel), LearnedProfile(o.kernel).distance_from_start()));
        if (run_.write_start) run_.write_start(run_.output / "dense_start");
    }
    write_cameras();
    write_file_atomic(run_.output / "cfg_args", cfg_args(dataset_, schedule_.options, run_.output));
    if (!run_.request.empty()) write_file_atomic(run_.output / "request.json", run_.request);
}

TrainResult Run::execute(const std::atomic<bool>* stop) {
    trainer_.on_result = [this](const IterationResult& result) { on_result(result); };
    begin();
    if (!run_.resume_from.empty() && is_finished()) return finished();
    // The file is from the end that was interrupted. The run goes on, and its scene is the latest
    // until it ends.
    std::error_code none;
    std::filesystem::remove(run_.output / "metrics.json", none);
    pace_ = run_.pace ? run_.pace : log_.pace();
    if (pace_) progress_.expect(schedule_, *pace_);
    log_.start(device_, rates_, dataset_, schedule_, trainer_.splat_count(), run_.effects_json,
               pace_);
    try {
        train(stop);
    } catch (const std::exception& e) {
        log_.failure(trainer_.iteration(), e.what());
        save_what_is_there(true);
        throw;
    }
    summary_.interrupted = trainer_.iteration() < trainer_.last_iteration();
    if (summary_.interrupted) save_what_is_there(false);
    report_troubles();
    report_cameras();
    report_kernel();
    progress_.finish();
    summary_.iteration = trainer_.iteration();
    summary_.seconds = seconds_;
    summary_.dropped = trainer_.counters().undrawn;
    summary_.passes = log_.passes(trainer_);
    summary_.report = log_.finish(summary_, trainer_, device_, run_.report);
    return summary_;
}

// failed: by something else than the device, as a full disk, which may have room for one of the
// two; what cannot be saved is left out, for the run ends with the first failure.
void Run::save_what_is_there(bool failed) {
    if (!whole_ || trainer_.iteration() >= trainer_.last_iteration()) return;
    std::string saved;
    const auto save = [&](const char* what, const auto& write) {
        try {
            write();
            saved += fmt::format("{}{}", saved.empty() ? "" : " and ", what);
        } catch (const std::exception&) {
            if (!failed) throw;
        }
    };
    save("the checkpoint", [&] { save_checkpoint(run_.output / "checkpoint.darb"); });
    save("the scene", [&] { save_model(trainer_.iteration()); });
    stopwatch(false);
    if (!saved.empty())
        progress_.note(fmt::format("iteration {}: saved {} in {}", trainer_.iteration(), saved,
                                   run_.output.string()));
}

// Recommends the other form of the backward blend, where that holds more intersections.
std::string Run::other_way() const {
    if (device_.tuning().backward == BackwardBlend::subgroup) return "";
    return fmt::format(
        ", and so does --tune backward=subgroup, which holds {}, in a run that "
        "starts again",
        FrameBuffers::max_intersections(device_, BackwardBlend::subgroup));
}

void Run::train(const std::atomic<bool>* stop) {
    const std::filesystem::path latest = run_.output / "checkpoint.darb";
    stopwatch(true);
    // A checkpoint of the run's end that was made in another folder.
    if (const int end = trainer_.last_iteration();
        trainer_.iteration() == end && !std::filesystem::exists(model_path(end))) {
        evaluate(end);
        save_model(end);
        save_checkpoint(latest);
    }
    whole_ = true;
    const Ranks* const ranks = run_.ranks.all;
    const std::uint64_t sent = ranks ? ranks->sent_bytes() : 0;
    const double waited = ranks ? ranks->seconds() : 0;
    const auto is_over = [&] {
        if (trainer_.iteration() >= trainer_.last_iteration()) return true;
        whole_ = false;  // a rank that differs: whose splats are right, nobody knows
        const bool stops = is_to_stop(trainer_, run_.ranks, stops_ || (stop && stop->load()));
        whole_ = true;
        return stops;
    };
    while (!is_over()) {
        whole_ = false;
        const int begin = trainer_.iteration();
        while_doing(fmt::format("iteration {}", begin + 1), [&] { trainer_.step(); });
        whole_ = true;
        while_doing(fmt::format("what follows iteration {}", trainer_.iteration()),
                    [&] { after_step(begin); });
        if (run_.on_step) show_step();
        ++summary_.trained_steps;
    }
    if (ranks) summary_.sent_bytes = ranks->sent_bytes() - sent;
    if (ranks) summary_.exchange_seconds = ranks->seconds() - waited;
    whole_ = false;
    trainer_.drain();
    whole_ = true;
    stopwatch(false);
}

// Handles the iterations (begin, now].
void Run::after_step(int begin) {
    report_resolution();
    report_memory();
    report_probes();
    const int i = trainer_.iteration();
    if (run_.look_again && !run_.ranks.all && i >= kLooksAgainAt &&
        trainer_.resolution_divisor() == 1 && !std::exchange(looked_at_forms_, true))
        look_at_forms();
    if (watch_.is_due(begin, i)) look_for_gain(i);
    const bool last = i == trainer_.last_iteration();
    if (last || contains(run_.test_iterations, begin, i)) evaluate(i);
    if (last || contains(run_.save_iterations, begin, i)) save_model(i);
    if (contains(run_.checkpoint_iterations, begin, i))
        save_checkpoint(run_.output / fmt::format("chkpnt{}.darb", i));
    if (last || (run_.checkpoint_interval > 0 &&
                 i / run_.checkpoint_interval != begin / run_.checkpoint_interval))
        save_checkpoint(run_.output / "checkpoint.darb");
}

// By the first training view, at its full size.
void Run::look_at_forms() {
    const std::optional<TuningRecord> record = read_tuning(device_.info(), device_.cache_folder());
    if (!record || record->seen_in_a_run) return;
    const auto trains = [](const View& view) { return !view.is_test; };
    const auto view = std::find_if(dataset_.views.begin(), dataset_.views.end(), trains);
    if (view == dataset_.views.end()) return;
    stopwatch(false);
    trainer_.drain();
    try {
        const TuningRecord seen =
            look_again(device_, *record,
                       {trainer_.splats(), camera_data(view->camera, trainer_.splats().origin()),
                        trainer_.sh_degree(), forward_options(options_now())});
        write_tuning(device_.info(), device_.cache_folder(), seen);
        if (seen.choice != record->choice)
            progress_.note(
                fmt::format("on the splats of this run other passes are faster: {}; they "
                            "are kept for the runs that follow",
                            names_text(seen.choice)));
    } catch (const NoRoom&) {  // a run that leaves no room for it is no place to measure
    }
    stopwatch(true);
}

// The mean is not there yet: looks are compared with each other, and not with the end.
void Run::look_for_gain(int iteration) {
    stopwatch(false);
    const double psnr_db = evaluate_held_out(trainer_, dataset_, photos_).psnr_db;
    log_.look(iteration, psnr_db);
    if (!std::isnan(psnr_db) && watch_.add({iteration, psnr_db})) {
        trainer_.end_early(iteration);
        watch_.set_end(trainer_.last_iteration());
        summary_.ended_early = watch_.reason();
        log_.ends_early(iteration, trainer_.last_iteration(), summary_.ended_early);
        progress_.note(fmt::format("iteration {}: the run ends with iteration {} of {}: {}",
                                   iteration, trainer_.last_iteration(),
                                   schedule_.options.iterations, summary_.ended_early));
    }
    stopwatch(true);
}

void Run::report_resolution() {
    const int divisor = trainer_.resolution_divisor();
    if (divisor == told_divisor_) return;
    told_divisor_ = divisor;
    const int i = trainer_.iteration();
    progress_.restart_rate(i);
    log_.resolution(i, divisor);
    progress_.note(divisor == 1
                       ? fmt::format("iteration {}: photos at their full size", i)
                       : fmt::format("iteration {}: photos at 1/{} of their sides", i, divisor));
}

void Run::report_memory() {
    if (trainer_.mean_left_out() && !std::exchange(told_no_mean_, true)) {
        progress_.warn(
            "no device memory is left for the mean of the last iterations: the run ends without; "
            "with --average-from 1 rates fall instead");
        log_.mean_left_out(trainer_.iteration());
    }
    const auto tell = [&](std::uint32_t splats, std::uint32_t& told, const char* limit,
                          const std::string& reason) {
        if (splats == told) return;
        if (told == 0)
            progress_.note(
                fmt::format("growth stops at {} splats: {}", count_text(splats), reason));
        log_.growth_stopped(trainer_.iteration(), limit, told = splats);
    };
    tell(trainer_.stopped_by_memory(), told_by_memory_, "memory", "--max-memory");
    tell(trainer_.stopped_by_intersections(), told_by_intersections_, "pairs",
         fmt::format("frames come near the {} intersections of splats with tiles that this device "
                     "can hold; a "
                     "smaller -r leaves room{}",
                     FrameBuffers::max_intersections(device_), other_way()));
}

void Run::report_probes() {
    for (; told_probes_ < trainer_.probes().size(); ++told_probes_) {
        const Trainer::Probe& p = trainer_.probes()[told_probes_];
        log_.probe(trainer_.iteration(), p);
        progress_.note(probe_text(p));
    }
}

void Run::report_cameras() {
    const std::optional<CameraMoves> m = trainer_.camera_moves();
    if (!m) return;
    progress_.note(fmt::format(
        "{} cameras moved by {:.2f} px and {:.3f} degrees in the middle, at most {:.2f} px and "
        "{:.3f} degrees; focal lengths by up to {:.2f} %, principal points by {:.2f} px",
        m->cameras, m->median_px, m->median_degrees, m->largest_px, m->largest_degrees,
        100 * m->largest_focal, m->largest_centre_px));
    if (m->shutters)
        progress_.note(fmt::format(
            "over a read-out they move by {:.2f} px more than the file says in the middle, at most "
            "by {:.2f} px",
            m->median_rolled_px, m->largest_rolled_px));
}

void Run::report_kernel() {
    if (schedule_.options.learn_kernel == 0) return;
    const int kernel = trainer_.kernel();
    progress_.note(fmt::format(
        "the learned kernel is {}, with support {:.3g}: darb psi --kernel-file {} shows it",
        kernel_name(kernel), kernel_support(kernel), (run_.output / "kernel.json").string()));
}

void Run::report_troubles() {
    if (const std::uint64_t bad = trainer_.counters().bad_gradients; bad > 0)
        progress_.warn(fmt::format("{} gradients of splats were not finite and were skipped", bad));
}

}  // namespace

TrainResult run_training(Device& device, const Dataset& dataset, const Schedule& schedule,
                         const RunOptions& run, const std::atomic<bool>* stop,
                         std::vector<ImageU8> photos) {
    for (const View& view : dataset.views)
        check_frame(device, view.camera.width, view.camera.height, view.name);
    if (run.ranks.several() && !run.ranks.all->is_first())
        return follow_training(device, dataset, schedule, run, stop, std::move(photos));
    check_gain_watch(dataset, schedule.options, run.ranks);
    check_run_folder(run.output, dataset);
    if (run.resume_from.empty() && !run.start) check_start_memory(device, dataset, schedule);
    return Run(device, dataset, schedule, run, std::move(photos)).execute(stop);
}

namespace {
constexpr int kStepsBetweenLooks = 64;  // from one look whether ranks are equal to the next
}  // namespace

std::optional<Checkpoint> checkpoint_of(Device& device, const RunOptions& run) {
    const std::filesystem::path& path = run.resume_from;
    const bool reads = !run.ranks.several() || run.ranks.all->is_first();
    Bytes file;
    if (reads && !path.empty()) file = read_file(path);
    if (run.ranks.several()) file = from_first(*run.ranks.all, file);
    if (file.empty() && (path.empty() || !reads)) return std::nullopt;
    Checkpoint checkpoint =
        while_doing(path.string(), [&] { return parse_checkpoint(file, path.string()); });
    device.set_tuning(
        resumed_tuning(device.info(), device.tuning(), checkpoint.tuning, path.string()));
    return checkpoint;
}

SplatModel first_model(const Dataset& dataset, const Schedule& schedule,
                       const std::optional<Checkpoint>& checkpoint, const SplatModel* given) {
    SplatModel model = given ? *given : initial_model(dataset, schedule);
    if (checkpoint) model.origin = checkpoint->state.model.origin;
    return model;
}

void check_ranks(const Device& device, const Schedule& schedule, const RankGroup& ranks,
                 const std::string& fingerprint) {
    if (!ranks.several()) return;
    RankFacts facts = ranks.mixed ? rank_facts() : rank_facts(device);
    facts.insert(facts.begin(), {"option --allow-mixed", ranks.mixed ? "on" : "off"});
    facts.emplace_back("data set", fingerprint);
    facts.emplace_back("settings", settings_text(schedule));
    check_same(*ranks.all, facts);
}

bool is_to_stop(Trainer& trainer, const RankGroup& ranks, bool stop) {
    if (!ranks.several()) return stop;
    const int steps = trainer.iteration() / trainer.views_a_step();
    if (!ranks.mixed && steps % kStepsBetweenLooks == 0)
        check_equal_splats(*ranks.all, trainer.splats(), trainer.iteration());
    return any_stops(*ranks.all, stop);
}

std::vector<ImageU8> photos_of_run(const Dataset& dataset, const TrainOptions& options,
                                   std::vector<ImageU8> loaded) {
    std::vector<ImageU8> photos = loaded.empty() ? load_photos(dataset.views) : std::move(loaded);
    if (options.alpha) return photos;
    for (ImageU8& photo : photos)
        if (photo.channels == 4)
            for (std::size_t a = 3; a < photo.data.size(); a += 4) photo.data[a] = 255;
    return photos;
}

TrainResult follow_training(Device& device, const Dataset& dataset, const Schedule& schedule,
                            const RunOptions& run, const std::atomic<bool>* stop,
                            std::vector<ImageU8> photos) {
    check_gain_watch(dataset, schedule.options, run.ranks);
    photos = photos_of_run(dataset, schedule.options, std::move(photos));
    photo_doubts(dataset, photos);  // throws; the first rank says them
    const std::string fingerprint = dataset_fingerprint(dataset, photos);
    const std::optional<Checkpoint> checkpoint = checkpoint_of(device, run);
    Trainer trainer(device, dataset, photos, first_model(dataset, schedule, checkpoint), schedule,
                    run.ranks);
    photos = {};  // they are where steps read them
    give_back_freed_memory();
    check_ranks(device, schedule, run.ranks, fingerprint);
    if (checkpoint) {
        check_resumable(*checkpoint, run.resume_from, schedule, dataset, fingerprint);
        trainer.restore(checkpoint->state);
    }
    while (trainer.iteration() < schedule.options.iterations &&
           !is_to_stop(trainer, run.ranks, stop && stop->load()))
        while_doing(fmt::format("iteration {}", trainer.iteration() + 1), [&] { trainer.step(); });
    TrainResult summary;
    summary.iteration = trainer.iteration();
    summary.interrupted = trainer.iteration() < schedule.options.iterations;
    return summary;
}

}  // namespace darb
