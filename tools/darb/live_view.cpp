#include "tools/darb/live_view.h"

#include <fmt/format.h>

#include <chrono>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "tools/darb/live_window.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/view_flags.h"
#include "trainer/job/scene_file.h"
#include "viewer/display_loss.h"
#include "viewer/seconds.h"

namespace darb {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPausedNap = std::chrono::milliseconds(20);

}  // namespace

struct LiveSystem::System {
    std::atomic<bool> lost{false};  // the display; before what it outlives
    WindowSystem windows;
    DeviceOptions device;  // of windows
};

LiveView::LiveView(std::unique_ptr<State> state) : state_(std::move(state)) {}
LiveView::~LiveView() = default;

// The run matters more than its window.
void LiveView::warn(const std::string& reason) {
    say("warning: the window is closed: {}; the run goes on\n", reason);
    state_.reset();
}

double LiveView::show(const LiveStep& step) {
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
    } catch (const DeviceLost&) {  // which is the run's, too
        throw;
    } catch (const std::exception& e) {
        failure = e.what();
    }
    lock.lock();
    const bool closed = s.closed;
    if (closed) failure = s.failure;
    lock.unlock();
    if (!failure.empty())
        warn(failure);
    else if (closed)
        state_.reset();
    return paused_s;
}

// Pictures go on: the user may look around.
double LiveView::wait_while_paused(const LiveStep& step) {
    State& s = *state_;
    const auto start = Clock::now();
    for (bool waited = false;; waited = true) {
        std::unique_lock lock(s.mutex);
        const bool steps = s.training.steps_to_go > 0;
        if (s.closed || s.stop || !s.training.paused || steps) {
            if (steps) --s.training.steps_to_go;
            return waited ? seconds_since(start) : 0;
        }
        lock.unlock();
        const bool drew = s.drawer.draw(step.splats, LiveChange::none, s.picture);
        lock.lock();
        if (!drew) s.changed.wait_for(lock, kPausedNap);
    }
}

void LiveView::finish(const std::filesystem::path& model) {
    if (!state_) return;
    State& s = *state_;
    {
        const std::lock_guard lock(s.mutex);
        s.finished = true;
        s.model = model;
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

// Where the window's thread lost the display, what this one asked of it would be waited for without
// end: it stays as it is until the process ends.
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

}  // namespace darb
