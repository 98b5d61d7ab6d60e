// SPDX-License-Identifier: MIT
#include "tools/darb/train_window.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include "engine/core/count_text.h"
#include "engine/core/process.h"
#include "engine/data/run_colmap.h"
#include "engine/data/video.h"
#include "engine/plan/tuner.h"
#include "engine/scene/splat_file.h"
#include "tools/darb/live_link.h"
#include "tools/darb/train_form.h"
#include "tools/darb/train_summary.h"
#include "trainer/job/job.h"
#include "trainer/job/photo_folder.h"
#include "trainer/job/request_options.h"
#include "trainer/job/training_data.h"
#include "trainer/run/forecast.h"
#include "trainer/run/run_folder.h"
#include "trainer/step/memory_plan.h"
#include "viewer/seconds.h"

namespace darb {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kIdle_s = 0.2, kBusy_s = 0.05;  // between two looks of the window's thread
constexpr double kTypingPause_s = 0.7;           // before photos are looked at
constexpr int kMeasurements = 10;                // of held-out photos, over a run
constexpr int kMeasuredRun = 200;  // iterations: a shorter run is over sooner than its forecast

/// What was found out about a run, for the form as it was at `version`.
struct Looked {
    int version = -1;
    TrainOutlook outlook;
    std::optional<Error> error;
};

void need_installed(const std::string& path, std::initializer_list<const char*> programs) {
    std::string missing;
    for (const char* program : programs)
        if (!is_installed(program)) missing += (missing.empty() ? "" : " ") + std::string(program);
    if (!missing.empty())
        throw Error(path, "has no cameras, and what finds them is not installed: " + missing,
                    "apt install " + missing);
}

constexpr const char* kCamerasFirst =
    "They have no cameras: COLMAP looks for these first, which takes longer than a short run. The "
    "forecast follows then.";

// Photos and videos without cameras; nothing where there are cameras.
std::vector<std::string> without_cameras(const TrainRequest& request) {
    std::error_code none;
    if (is_video_name(request.dataset) && !fs::is_directory(request.dataset, none)) {
        need_installed(request.dataset, {"ffmpeg", "colmap"});
        return {fmt::format("A video of {:.0f} MB, of which ffmpeg takes the sharpest pictures.",
                            double(fs::file_size(request.dataset, none)) / 1e6),
                kCamerasFirst};
    }
    const fs::path photos = photos_without_cameras(request.dataset, request.data.images_folder);
    if (photos.empty()) return {};
    const PhotoList list = list_photos(photos);
    std::vector<std::string> lines{counted(list.names.size(), "photo") +
                                   (list.one_size ? " of one size." : " of several sizes.")};
    if (!list.left_out.empty()) lines.push_back(list.left_out);
    need_installed(request.dataset, {"colmap"});
    if (fs::exists(request.output / "colmap" / "dense" / "sparse"))
        lines.emplace_back("The output folder has their cameras, which COLMAP found before.");
    else
        lines.emplace_back(kCamerasFirst);
    return lines;
}

std::vector<std::string> what_it_holds(const TrainJob& job) {
    const Dataset& d = job.dataset;
    const auto held_out = static_cast<std::size_t>(std::ranges::count_if(d.views, &View::is_test));
    std::vector<std::string> lines{fmt::format("{}: {} to train on, {} held out, {}.", d.source,
                                               counted(d.views.size() - held_out, "photo"),
                                               count_text(held_out),
                                               counted(d.points.size(), "point"))};
    if (!d.views.empty()) {
        const Camera& c = d.views.front().camera;
        lines.front() += fmt::format(" The first one is {} x {} px.", c.width, c.height);
    }
    if (fs::exists(job.request.output / "run.jsonl"))
        lines.emplace_back(
            "The output folder holds an earlier run, which is kept beside it as earlier.1 or the "
            "next free number.");
    for (const std::string& note : {job.region_note, job.strategy_note, job.cameras_note})
        if (!note.empty()) lines.push_back(note);
    for (const std::vector<std::string>* notes : {&d.notes, &job.notes})
        lines.insert(lines.end(), notes->begin(), notes->end());
    if (starts_from_stereo(job))
        lines.emplace_back("Stereo between the photos finds what splats start from first.");
    return lines;
}

std::vector<std::string> forecast_lines(const Device& device, const TrainJob& job,
                                        const Forecast& f) {
    const std::uint64_t bytes = plan_memory(device, f.peak).total();
    const std::uint64_t most = job.options.max_memory_bytes.value_or(usable_bytes(device.info()));
    std::uint64_t unit = 1;  // two digits: more would promise what a rule of thumb cannot keep
    while (f.splats / unit >= 100) unit *= 10;
    std::vector<std::string> lines{
        fmt::format("{}{} splats at the end, {} at the start", unit > 1 ? "about " : "",
                    count_text((f.splats + unit / 2) / unit * unit), count_text(f.start_splats)),
        (f.seconds > 0 ? "about " + format_duration(f.seconds) + " for " : std::string()) +
            count_text(static_cast<std::uint64_t>(job.options.iterations)) + " iterations on " +
            device.info().name,
        fmt::format("{} of device memory", format_bytes(static_cast<double>(bytes)))};
    if (bytes > most)
        lines.push_back(fmt::format(
            "That is more than the {} which this device allows: name fewer splats, or a shorter "
            "length with smaller photos.",
            format_bytes(static_cast<double>(most))));
    return lines;
}

/// Something else was typed meanwhile.
struct Overtaken {};

std::string words_of(const std::exception& e) {
    const auto* const known = dynamic_cast<const Error*>(&e);
    return known != nullptr ? known->where + ": " + known->reason + ".\n" + known->hint : e.what();
}

}  // namespace

struct TrainWindow::State {
    State(ViewerWindow& window_, std::string device_)
        : window(&window_), device(std::move(device_)) {}
    ~State() {
        stop = true;
        {
            const std::lock_guard lock(mutex);
            leaves = true;
            if (link) link->close();
        }
        for (std::thread* thread : {&looker, &runner})
            if (thread->joinable()) thread->join();
    }
    TrainForm& form() const { return window->viewer().session().train_form; }
    void judge();
    void look(const TrainRequest& request, int version);
    void tell_outlook(Looked found);
    void take_outlook();
    void begin();
    void wait_for_look();
    void train(TrainRequest request);
    void train_on(Device& run_device, TrainJob& job, const TrainRequest& request);
    void set_stage(std::string text);
    void follow_run();
    void take_end();

    ViewerWindow* window;
    std::string device;

    // Of the window's thread.
    TrainRequest request;  // as it was judged last
    int judged = -1;       // the form's version then
    Clock::time_point judged_at;
    int looked = -1;        // the version that was or is looked at
    bool prepared = false;  // the window has made room for the run
    bool let_go = false;    // and shows no more of it, so that its link may be gone

    std::thread looker, runner;
    std::atomic<bool> stop{false};
    std::atomic<int> wanted{-1};  // the version that somebody waits for
    std::mutex mutex;             // guards the rest
    std::optional<Looked> found;
    bool looking = false;
    std::string stage;
    std::unique_ptr<LiveLink> link;
    std::vector<View> views;  // of the run
    bool leaves = false;      // the window closes
    bool ended = false;       // the run
    std::optional<Error> failure;
};

void TrainWindow::State::judge() {
    TrainForm& f = form();
    if (f.version == judged) return;
    wanted = judged = f.version;
    judged_at = Clock::now();
    f.outlook = {};
    request = judge_form(f);
    if (request.device.empty()) request.device = device;
    if (!f.has_error() && !request.dataset.empty()) f.outlook.looking = "looking at the photos";
    window->redraw();
}

void TrainWindow::State::tell_outlook(Looked one) {
    {
        const std::lock_guard lock(mutex);
        found = std::move(one);
    }
    window->wake();
}

// In a thread of its own, on a device of its own.
void TrainWindow::State::look(const TrainRequest& asked, int version) {
    Looked one{version, {}, {}};
    try {
        one.outlook.holds = without_cameras(asked);
        if (one.outlook.holds.empty()) {
            TrainRequest copy = asked;
            std::optional<RunLock> lock;
            Dataset dataset = load_training_data(copy, lock, {.quiet = true, .stop = &stop});
            check_run_folder(copy.output, dataset);
            const TrainJob job = resolve(copy, std::move(dataset));
            one.outlook.holds = what_it_holds(job);
            one.outlook.looking = "forecasting";
            tell_outlook(one);
            if (wanted != version || stop) throw Overtaken();
            Device scratch(command_device(copy.device));
            settle_tuning(scratch, copy.tune, false);
            const Forecast f = forecast_training(scratch, job.dataset, job.options,
                                                 job.options.iterations >= kMeasuredRun);
            one.outlook.forecast = forecast_lines(scratch, job, f);
        }
    } catch (const Overtaken&) {
    } catch (const Error& e) {
        one.error = e;
    } catch (const std::exception& e) {
        one.error = Error("forecast", e.what());
    }
    one.outlook.looking.clear();
    {
        const std::lock_guard lock(mutex);
        looking = false;
    }
    tell_outlook(std::move(one));
}

void TrainWindow::State::take_outlook() {
    std::optional<Looked> one;
    bool busy = false;
    {
        const std::lock_guard lock(mutex);
        one = std::exchange(found, std::nullopt);
        busy = looking;
    }
    TrainForm& f = form();
    if (one && one->version == judged) {
        f.outlook = one->outlook;
        if (one->error) blame_field(*one->error, f);
        window->redraw();
    }
    const bool due = f.shown && looked != judged && !f.has_error() && !request.dataset.empty() &&
                     seconds_since(judged_at) >= kTypingPause_s;
    if (busy || !due || f.starts || !f.stage.empty() || f.runs) return;
    if (looker.joinable()) looker.join();
    looked = judged;
    looking = true;
    looker = std::thread([this, asked = request, version = judged] { look(asked, version); });
}

void TrainWindow::State::set_stage(std::string text) {
    {
        const std::lock_guard lock(mutex);
        stage = std::move(text);
    }
    window->wake();
}

void TrainWindow::State::begin() {
    TrainForm& f = form();
    f.starts = false;
    if (f.has_error() || request.dataset.empty() || f.runs) return;
    Session& s = window->viewer().session();
    if (unsaved_edits(s) || unsaved_mesh(s)) {
        s.tell("The scene that is open has edits that are not saved: save them, or undo them.");
        return;
    }
    if (runner.joinable()) runner.join();
    stop = false;
    prepared = let_go = ended = false;
    failure.reset();
    f.runs = true;
    stage = "waiting for the forecast";
    TrainRequest asked = request;
    if (asked.data.hold_out && !was_given(asked, "--test-iterations"))
        for (int n = 1; n < kMeasurements; ++n)  // for a curve; the end is measured anyway
            if (const int at = int(std::int64_t{asked.train.iterations} * n / kMeasurements);
                at > 0)
                asked.test_iterations.push_back(at);
    runner = std::thread([this, asked = std::move(asked)] { train(asked); });
}

// A forecast and a run at once would slow each other down.
void TrainWindow::State::wait_for_look() {
    constexpr auto kNap = std::chrono::milliseconds(20);
    for (;; std::this_thread::sleep_for(kNap)) {
        const std::lock_guard lock(mutex);
        if (!looking || stop) return;
    }
}

void TrainWindow::State::train(TrainRequest asked) {
    std::optional<Error> failed;
    try {
        wait_for_look();
        set_stage("reading the photos");
        std::optional<RunLock> lock;
        DataSinks data{.quiet = true, .stop = &stop, .said = {}};
        data.said = [this](std::string_view line) { set_stage(std::string(line)); };
        Device run_device(command_device(asked.device));
        settle_tuning(run_device, asked.tune, false);
        Dataset dataset = load_training_data(asked, lock, data);
        check_run_folder(asked.output, dataset);
        if (!lock) lock.emplace(asked.output);
        TrainJob job = resolve(asked, std::move(dataset));
        if (!stop)
            find_start(run_device, job,
                       [this] { set_stage("finding surfaces by stereo between the photos"); });
        check_start_memory(run_device, job.dataset, job.options);
        train_on(run_device, job, asked);
    } catch (const ColmapStopped&) {
    } catch (const Error& e) {
        failed = e;
    } catch (const std::exception& e) {
        failed = Error("training", e.what());
    }
    const std::lock_guard lock(mutex);
    failure = std::move(failed);
    ended = true;
    window->wake();
}

void TrainWindow::State::train_on(Device& run_device, TrainJob& job, const TrainRequest& asked) {
    if (job.options.iterations >= kMeasuredRun && !stop) {
        set_stage("measuring how long it will take");
        Device scratch(command_device(asked.device));
        scratch.set_tuning(run_device.tuning());
        job.pace = pace_of(forecast_training(scratch, job.dataset, job.options));
    }
    if (stop) return;  // cancelled before anything was written
    set_stage("beginning");
    LiveLink* mine = nullptr;
    {
        auto made =
            std::make_unique<LiveLink>(run_device, job.dataset, stop, [this] { window->wake(); });
        mine = made.get();
        const std::lock_guard lock(mutex);
        views = job.dataset.views;
        if (leaves) made->close();
        link = std::move(made);
    }
    std::filesystem::path model;
    std::string said;
    std::optional<Error> failed;
    try {
        JobSinks sinks{.quiet = true, .stop = &stop};
        sinks.on_step = [mine](const LiveStep& step) { return mine->show(step); };
        const TrainResult result = run(run_device, job, sinks);
        model = result.model;
        if (leave_page(run_device, job, result, mine->publishes()))
            said = "web page in " + (asked.output / "scene.html").string();
    } catch (const std::exception& e) {
        const auto* const known = dynamic_cast<const Error*>(&e);
        failed = known != nullptr ? *known : Error("training", e.what());
    }
    mine->finish(model, said);
    mine->wait_until_let_go();
    std::unique_ptr<LiveLink> done;
    {
        const std::lock_guard lock(mutex);
        done = std::move(link);
    }
    done.reset();  // before the device
    if (failed) throw Error(*failed);
}

void TrainWindow::State::follow_run() {
    TrainForm& f = form();
    if (std::exchange(f.cancels, false)) stop = true;
    if (let_go) return;
    LiveLink* now = nullptr;
    std::vector<View> of_run;
    {
        const std::lock_guard lock(mutex);
        f.stage = f.runs && !link && !ended ? stage : "";
        now = link.get();
        if (now != nullptr && !prepared) of_run = std::move(views);
    }
    if (now == nullptr) return;
    if (!prepared) {
        prepared = true;
        f.shown = false;
        Session& s = window->viewer().session();
        window->viewer().make_room_for_run(std::move(of_run));
        s.training.live = true;
        s.title = scene_name(request.output, true) + " - training - darb";
        if (request.train.white_background) s.display.background = glm::vec3(1.0f);
    }
    now->follow(*window);
    if (!now->ended()) return;
    let_go = true;
    now->close();
}

void TrainWindow::State::take_end() {
    std::optional<Error> why;
    {
        const std::lock_guard lock(mutex);
        if (!ended) return;
        why = std::exchange(failure, std::nullopt);
        ended = false;
    }
    if (runner.joinable()) runner.join();
    TrainForm& f = form();
    f.runs = false;
    f.stage.clear();
    if (why && prepared) {  // the form is closed
        window->viewer().session().error = words_of(*why);
    } else if (why) {
        f.shown = true;
        blame_field(*why, f);
    }
    window->redraw();
}

TrainWindow::TrainWindow(ViewerWindow& window, std::string device)
    : state_(std::make_unique<State>(window, std::move(device))) {
    state_->form().fields = train_fields();
}

TrainWindow::~TrainWindow() = default;

double TrainWindow::follow() {
    State& s = *state_;
    s.judge();
    s.take_outlook();
    if (s.form().starts) s.begin();
    s.follow_run();
    s.take_end();
    const TrainForm& f = s.form();
    return f.runs || f.shown ? kBusy_s : kIdle_s;
}

}  // namespace darb
