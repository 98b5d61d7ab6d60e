#include "tools/darb/live_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "tools/darb/live_curves.h"
#include "tools/darb/scene_file.h"
#include "tools/darb/view_flags.h"
#include "viewer/display_loss.h"
#include "viewer/window.h"

namespace darb {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kShare = 0.1;       // of the time that pictures may take from training
constexpr double kShortest_s = 0.2;  // between two pictures
constexpr double kPausedNap_s = 0.1;

}  // namespace

struct LiveSystem::System {
    std::atomic<bool> lost{false};  // the display; before what it outlives
    WindowSystem windows;
};

struct LiveView::State {
    State(Device& device, ViewerOptions options, const Dataset& dataset,
          const std::atomic<bool>& stop_, const std::atomic<bool>& lost_)
        : window(std::make_unique<ViewerWindow>(device, std::move(options), 1280, 720)),
          bounds(bounds_of(dataset)),
          stop(stop_),
          lost(lost_) {
        window->set_title("training - darb");
        if (!dataset.views.empty()) window->viewer().choose_camera(0);
    }

    Session& session() { return window->viewer().session(); }

    std::unique_ptr<ViewerWindow> window;  // null once closed
    Bounds bounds;
    const std::atomic<bool>& stop;
    const std::atomic<bool>& lost;  // the display
    Clock::time_point next_picture{};
    LiveCurves curves;
};

LiveView::LiveView(std::unique_ptr<State> state) : state_(std::move(state)) {}
LiveView::~LiveView() = default;

// The run matters more than its window.
void LiveView::warn(const std::exception& error) {
    const auto* known = dynamic_cast<const Error*>(&error);
    say("warning: the window is closed: {}; the run goes on\n", state_->lost ? "the display is gone"
                                                                : known != nullptr ? known->reason
                                                                                   : error.what());
    state_->window.reset();
}

void LiveView::check_display() const {
    if (state_->lost) throw Error("window", "the display is gone");
}

double LiveView::show(const LiveStep& step) {
    if (!state_->window) return 0;
    try {
        return pump(step);
    } catch (const std::exception& e) {
        warn(e);
        return 0;
    }
}

double LiveView::pump(const LiveStep& step) {
    State& s = *state_;
    TrainingCurves& training = s.session().training;
    s.curves.add(step, training);
    const auto now = Clock::now();
    if (now >= s.next_picture || training.paused) {
        s.window->viewer().show_live(step.splats, s.bounds);
        s.window->redraw();
        const double cost_s = s.session().times.frame_ms / 1000;
        s.next_picture =
            now + std::chrono::duration_cast<Clock::duration>(
                      std::chrono::duration<double>(std::max(kShortest_s, cost_s / kShare)));
    }
    bool open = s.window->pump(0);
    check_display();
    training.steps_to_go = std::max(0, training.steps_to_go - 1);
    const auto paused = Clock::now();
    double paused_s = 0;
    while (open && training.paused && training.steps_to_go == 0 && !s.stop) {
        open = s.window->pump(kPausedNap_s);
        check_display();
        paused_s = std::chrono::duration<double>(Clock::now() - paused).count();
    }
    if (!open) s.window.reset();
    return paused_s;
}

void LiveView::finish(const std::filesystem::path& model) {
    State& s = *state_;
    if (!s.window) return;
    try {
        if (std::getenv("DARB_VIEW_GAPS") != nullptr)
            say("longest gap of the window: {:.0f} ms\n", s.window->longest_gap_s() * 1000);
        s.window->viewer().end_live();
        if (!model.empty()) s.window->viewer().open(model);
        while (!s.stop && s.window->pump(kPausedNap_s)) check_display();
        s.window.reset();
    } catch (const std::exception& e) {
        warn(e);
    }
}

LiveSystem::LiveSystem(bool on, DeviceOptions& options) {
    if (!on) return;
    try {
        system_ = std::make_unique<System>();
    } catch (const Error& e) {
        throw Error(e.where, e.reason, "Start it inside a desktop session, or leave out --view.");
    }
    system_->windows.require(options);
    survive_display_loss(system_->lost);
}

LiveSystem::~LiveSystem() = default;

std::unique_ptr<LiveView> LiveSystem::open(Device& device, const Dataset& dataset,
                                           const std::atomic<bool>& stop, bool white) const {
    if (!system_) return nullptr;
    ViewerOptions options;
    options.views = dataset.views;
    options.resolve = find_scene;
    options.find_cameras = cameras_beside;
    auto state =
        std::make_unique<LiveView::State>(device, std::move(options), dataset, stop, system_->lost);
    if (white) state->session().display.background = glm::vec3(1.0f);
    return std::make_unique<LiveView>(std::move(state));
}

}  // namespace darb
