#include "tools/darb/live_window.h"

#include <utility>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr double kNap_s = 0.05;    // of the window, between two looks at the run
constexpr double kRedraw_s = 0.2;  // between two redraws for the curves alone

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
        struct Forget {  // before the window goes, whichever way it does
            State& state;
            ~Forget() {
                const std::lock_guard lock(state.mutex);
                state.window = nullptr;
            }
        } const forget{*this};
        shown.set_title("training - darb");
        Session& session = shown.viewer().session();
        if (!session.photos.views.empty()) shown.viewer().choose_camera(0);
        session.training.live = true;  // nothing may be opened from now on
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

// What the user wants goes to the run, what it reports to the user.
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
    if (version != followed &&
        std::chrono::steady_clock::now() - redrawn >= std::chrono::duration<double>(kRedraw_s)) {
        const bool live = seen.live, was_finished = seen.finished;
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
    lock.unlock();
    viewer.end_live();
    if (!scene_file.empty()) viewer.open(scene_file);
}

}  // namespace darb
