// SPDX-License-Identifier: MIT
#include "tools/darb/live_view.h"

#include <fmt/format.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/data/point_cloud_ply.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/view.h"
#include "trainer/job/scene_file.h"
#include "viewer/live_picture.h"
#include "viewer/picture_pacing.h"
#include "viewer/seconds.h"
#include "viewer/window.h"

namespace darb {

/// The window has a thread and a device of its own; the mutex guards what both threads use.
struct LiveView::State {
    State(Device& device, ViewerOptions options, const Dataset& dataset, DeviceOptions of_window,
          const std::atomic<bool>& stop_, const std::atomic<bool>& lost_, bool white_)
        : viewer_options(std::move(options)),
          window_device(std::move(of_window)),
          bounds(bounds_of(dataset)),
          stop(stop_),
          lost(lost_),
          white(white_),
          picture([this] { wake(); }),
          drawer(device, dataset.views, bounds),
          thread([this] { show_window(); }) {}
    ~State() {
        leave = true;
        wake();
        if (thread.joinable()) thread.join();
    }

    void wake();
    void show_window();
    void follow_run(ViewerWindow& shown);
    void check_display() const;

    ViewerOptions viewer_options;
    DeviceOptions window_device;
    Bounds bounds;
    const std::atomic<bool>& stop;
    const std::atomic<bool>& lost;
    bool white;
    LivePicture picture;
    LiveDrawer drawer;  // used by the run's thread
    LiveCurves curves;  // used by the run's thread

    std::mutex mutex;
    std::condition_variable changed;
    ViewerWindow* window = nullptr;
    TrainingCurves training;  // what the run reports; pause and steps are the user's
    std::optional<LiveScene> scene;
    std::filesystem::path model;
    std::string last_words;  // once the run is over
    RunWishes wishes;
    int version = 0;  // version of `training`
    bool closed = false, finished = false;
    std::atomic<bool> leave{false};  // set when the run failed
    std::string failure;             // why the window closed by itself

    int followed = 0;  // the version that the window's thread shows
    std::chrono::steady_clock::time_point redrawn;
    bool begun = false, ended = false;
    std::thread thread;  // the last member, because it uses all others
};

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPausedNap = std::chrono::milliseconds(20);

}  // namespace

struct LiveSystem::System {
    // set when the display is gone; declared before what it must outlive
    std::atomic<bool> lost{false};
    WindowSystem windows;
    DeviceOptions device;  // with what windows need
};

LiveView::LiveView(std::unique_ptr<State> state) : state_(std::move(state)) {}
LiveView::~LiveView() = default;

// A failing window must not stop the run.
void LiveView::warn(const std::string& reason) {
    say("warning: the window is closed: {}; the run goes on\n", reason);
    state_.reset();
}

LiveAnswer LiveView::show(const LiveStep& step) {
    if (!state_) return 0;
    State& s = *state_;
    std::unique_lock lock(s.mutex);
    s.curves.add(step, s.training);
    s.scene = live_scene(step.splats);
    ++s.version;
    const LiveChange change = s.training.paused ? LiveChange::at_once : LiveChange::seldom;
    lock.unlock();
    double paused_s = 0;
    std::string failure;
    try {
        s.drawer.draw(step.splats, change, s.picture);
        paused_s = wait_while_paused(step);
    } catch (const DeviceLost&) {  // the run has lost it, too
        throw;
    } catch (const std::exception& e) {
        failure = e.what();
    }
    LiveAnswer answer = take_wishes(paused_s);
    lock.lock();
    const bool closed = s.closed;
    if (closed) failure = s.failure;
    lock.unlock();
    if (!failure.empty())
        warn(failure);
    else if (closed)
        state_.reset();
    return answer;
}

LiveAnswer LiveView::take_wishes(double paused_s) {
    State& s = *state_;
    LiveAnswer answer(paused_s);
    const RunSettings now = [&] {
        const std::lock_guard lock(s.mutex);
        return s.training.settings;
    }();
    for (const RunWish& wish : s.wishes.take()) {
        if (wish.change) answer.changes.push_back(change_of(*wish.change, now));
        answer.measures |= wish.measures;
        answer.saves |= wish.saves;
        answer.stops |= wish.stops;
        publishes_ |= wish.stops && wish.publishes;
        answer.again = true;
    }
    const std::lock_guard lock(s.mutex);
    answer.again &= s.training.paused && s.training.steps_to_go == 0;
    return answer;
}

// Pictures go on while paused, because the user may look around.
double LiveView::wait_while_paused(const LiveStep& step) {
    State& s = *state_;
    const auto start = Clock::now();
    for (bool waited = false;; waited = true) {
        std::unique_lock lock(s.mutex);
        const bool steps = s.training.steps_to_go > 0;
        if (s.closed || s.stop || !s.training.paused || steps || !s.wishes.empty()) {
            if (steps) --s.training.steps_to_go;
            return waited ? seconds_since(start) : 0;
        }
        lock.unlock();
        const bool drew = s.drawer.draw(step.splats, LiveChange::none, s.picture);
        lock.lock();
        if (!drew) s.changed.wait_for(lock, kPausedNap);
    }
}

void LiveView::finish(const std::filesystem::path& model, const std::string& said) {
    if (!state_) return;
    State& s = *state_;
    {
        const std::lock_guard lock(s.mutex);
        s.finished = true;
        s.model = model;
        s.last_words = said;
    }
    s.wake();
    s.thread.join();
    if (!s.failure.empty()) warn(s.failure);
    state_.reset();
}

LiveSystem::LiveSystem(bool on, const DeviceOptions& options) {
    if (!on) return;
    try {
        system_ = std::make_unique<System>();
    } catch (const Error& e) {
        throw Error(e.where, e.reason, "Start it inside a desktop session, or leave out --view.");
    }
    system_->device = options;
    system_->device.faults = {};
    system_->windows.require(system_->device);
    survive_display_loss(system_->lost);
}

// Where the window's thread lost the display, requests of this thread would wait without end, so
// the window system stays as it is until the process ends.
LiveSystem::~LiveSystem() {
    if (!system_ || !system_->lost) return;
    static const System* const kept = system_.release();
    static_cast<void>(kept);
}

std::unique_ptr<LiveView> LiveSystem::open(Device& device, const Dataset& dataset,
                                           const std::atomic<bool>& stop, bool white) const {
    if (!system_) return nullptr;
    ViewerOptions options;
    options.views = dataset.views;
    options.resolve = find_scene;
    options.find_cameras = cameras_beside;
    return std::make_unique<LiveView>(std::make_unique<LiveView::State>(
        device, std::move(options), dataset, system_->device, stop, system_->lost, white));
}

namespace {

constexpr double kMiB = 1024.0 * 1024.0;
constexpr size_t kLongestCurve = 1000;
constexpr std::size_t kPointsLookedAt = 20'000;
constexpr float kSmoothing = 0.05f;  // for loss and PSNR, which jump from photo to photo

void thin(std::vector<float>& values) {
    for (size_t i = 0; 2 * i < values.size(); ++i) values[i] = values[2 * i];
    values.resize((values.size() + 1) / 2);
}

}  // namespace

Bounds bounds_of(const Dataset& dataset) {
    const std::size_t step = dataset.points.size() / kPointsLookedAt + 1;
    PointCloud few;
    for (std::size_t i = 0; i < dataset.points.size(); i += step)
        for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
            few.position.push_back(dataset.points.position[c]);
            few.colour.push_back(dataset.points.colour[c]);
        }
    if (few.size() > 0) return subject_of(points_as_splats(few), cameras_of(dataset.views));
    Bounds bounds;
    for (const View& view : dataset.views)
        bounds.centre += view.camera.centre() / double(dataset.views.size());
    bounds.radius = std::max(scene_extent(dataset), 1e-3);
    return bounds;
}

void LiveCurves::add(const LiveStep& step, TrainingCurves& t) {
    t.iteration = step.iteration;
    t.last_iteration = step.last_iteration;
    t.seconds_left = step.seconds_left;
    t.memory_bytes = step.memory_bytes;
    t.settings = settings_of(step.options);
    t.said = step.said;
    for (size_t e = t.held_out_psnr_db.size(); e < step.evaluations.size(); ++e) {
        t.held_out_psnr_db.push_back(static_cast<float>(step.evaluations[e].psnr_db));
        t.held_out_at.push_back(step.evaluations[e].iteration);
    }
    const IterationResult& r = step.result;
    if (r.iteration == last) return;
    last = r.iteration;
    const float share = t.loss.empty() ? 1 : kSmoothing;
    loss += share * (static_cast<float>(r.loss) - loss);
    psnr_db += share * (static_cast<float>(r.psnr_db) - psnr_db);
    if (r.iteration % stride != 0 && !t.loss.empty()) return;
    t.loss.push_back(loss);
    t.psnr_db.push_back(psnr_db);
    t.splats.push_back(static_cast<float>(r.splats));
    if (t.loss.size() > kLongestCurve) {
        for (std::vector<float>* curve : {&t.loss, &t.psnr_db, &t.splats}) thin(*curve);
        stride *= 2;
    }
}

RunSettings settings_of(const TrainOptions& o) {
    return {o.iterations, o.max_splats.value_or(0), double(o.max_memory_bytes.value_or(0)) / kMiB};
}

RunChange change_of(const RunSettings& wanted, const RunSettings& now) {
    RunChange change;
    if (wanted.iterations > 0 && wanted.iterations != now.iterations)
        change.iterations = wanted.iterations;
    if (wanted.max_splats > 0 && wanted.max_splats != now.max_splats)
        change.max_splats = wanted.max_splats;
    if (wanted.max_memory_mib >= 0 && wanted.max_memory_mib != now.max_memory_mib)
        change.max_memory_bytes = static_cast<std::uint64_t>(wanted.max_memory_mib * kMiB);
    return change;
}

namespace {

constexpr double kNap_s = 0.05;    // the window's pause between two looks at the run
constexpr double kRedraw_s = 0.2;  // time between two redraws for the curves alone

}  // namespace

void LiveView::State::wake() {
    const std::lock_guard lock(mutex);
    if (window != nullptr) window->wake();
}

void LiveView::State::check_display() const {
    if (lost) throw Error("window", "the display is gone");
}

void LiveView::State::show_window() {
    try {
        Device device(window_device);
        viewer_options.second_device = window_device;
        ViewerWindow shown(device, viewer_options, 1280, 720);
        struct Forget {  // runs before the window is destroyed, however that happens
            State& state;
            ~Forget() {
                const std::lock_guard lock(state.mutex);
                state.window = nullptr;
            }
        } const forget{*this};
        shown.set_title("training - darb");
        Session& session = shown.viewer().session();
        if (!session.photos.views.empty()) shown.viewer().choose_camera(0);
        session.training.live = true;  // from now on nothing may be opened
        if (white) session.display.background = glm::vec3(1.0f);
        {
            const std::lock_guard lock(mutex);
            window = &shown;
        }
        do {
            follow_run(shown);
            check_display();
        } while (!(ended && stop) && !leave && shown.pump(kNap_s));
    } catch (const std::exception& e) {
        const auto* known = dynamic_cast<const Error*>(&e);
        const std::lock_guard lock(mutex);
        failure = lost ? "the display is gone" : known != nullptr ? known->reason : e.what();
    }
    const std::lock_guard lock(mutex);
    closed = true;
    changed.notify_all();
}

// Passes the user's wishes to the run, and the run's reports to the user.
void LiveView::State::follow_run(ViewerWindow& shown) {
    Viewer& viewer = shown.viewer();
    TrainingCurves& seen = viewer.session().training;
    std::unique_lock lock(mutex);
    if (scene && !begun) viewer.show_live(picture, bounds, *scene);
    begun |= scene.has_value();
    if (seen.paused != training.paused || seen.steps_to_go > 0) {
        training.paused = seen.paused;
        training.steps_to_go += std::exchange(seen.steps_to_go, 0);
        changed.notify_all();
    }
    std::vector<RunWish>& asked = viewer.session().run_desk.wishes;
    if (!asked.empty()) {
        wishes.ask(std::exchange(asked, {}));
        changed.notify_all();
    }
    if (version != followed &&
        std::chrono::steady_clock::now() - redrawn >= std::chrono::duration<double>(kRedraw_s)) {
        const bool live = seen.live, was_finished = seen.finished;
        for (std::size_t i = seen.said.size(); i < training.said.size(); ++i)
            viewer.session().tell(training.said[i]);
        followed = version;
        seen = training;
        seen.live = live;
        seen.finished = was_finished;
        seen.steps_to_go = 0;
        redrawn = std::chrono::steady_clock::now();
        shown.redraw();
    }
    if (!finished || ended) return;
    ended = true;
    const std::filesystem::path scene_file = model;
    const std::string said = last_words;
    lock.unlock();
    viewer.end_live();
    if (!said.empty()) viewer.session().tell(said);
    if (!scene_file.empty()) viewer.open(scene_file);
}

}  // namespace darb
