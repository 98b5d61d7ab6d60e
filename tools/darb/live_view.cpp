// SPDX-License-Identifier: MIT
#include "tools/darb/live_view.h"

#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "tools/darb/live_link.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/view.h"
#include "trainer/job/scene_file.h"
#include "viewer/window.h"

namespace darb {

/// The window has a thread and a device of its own; the mutex guards what both threads use.
struct LiveView::State {
    State(Device& device, ViewerOptions options, const Dataset& dataset, DeviceOptions of_window,
          const std::atomic<bool>& stop_, const std::atomic<bool>& lost_, bool white_)
        : viewer_options(std::move(options)),
          window_device(std::move(of_window)),
          stop(stop_),
          lost(lost_),
          white(white_),
          link(device, dataset, stop_, [this] { wake(); }),
          thread([this] { show_window(); }) {}
    ~State() {
        leave = true;
        wake();
        if (thread.joinable()) thread.join();
    }

    void wake();
    void show_window();
    void check_display() const;

    ViewerOptions viewer_options;
    DeviceOptions window_device;
    const std::atomic<bool>& stop;
    const std::atomic<bool>& lost;
    bool white;
    LiveLink link;

    std::mutex mutex;
    ViewerWindow* window = nullptr;
    std::atomic<bool> leave{false};  // set when the run failed
    std::string failure;             // why the window closed by itself

    std::thread thread;  // the last member, because it uses all others
};

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
    publishes_ = publishes();
    state_.reset();
}

bool LiveView::publishes() const {
    return state_ ? state_->link.publishes() : publishes_;
}

LiveAnswer LiveView::show(const LiveStep& step) {
    if (!state_) return 0;
    State& s = *state_;
    LiveAnswer answer = 0;
    std::string failure;
    try {
        answer = s.link.show(step);
    } catch (const DeviceLost&) {  // the run has lost it, too
        throw;
    } catch (const std::exception& e) {
        failure = e.what();
    }
    const bool closed = s.link.closed();
    if (closed) {
        const std::lock_guard lock(s.mutex);
        failure = s.failure;
    }
    if (!failure.empty()) {
        warn(failure);
    } else if (closed) {
        publishes_ = publishes();
        state_.reset();
    }
    return answer;
}

void LiveView::finish(const std::filesystem::path& model, const std::string& said) {
    if (!state_) return;
    State& s = *state_;
    s.link.finish(model, said);
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

constexpr double kNap_s = 0.05;  // the window's pause between two looks at the run

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
            link.follow(shown);
            check_display();
        } while (!(link.ended() && stop) && !leave && shown.pump(kNap_s));
    } catch (const std::exception& e) {
        const auto* known = dynamic_cast<const Error*>(&e);
        const std::lock_guard lock(mutex);
        failure = lost ? "the display is gone" : known != nullptr ? known->reason : e.what();
    }
    link.close();
}

}  // namespace darb
