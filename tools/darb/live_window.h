// The window of darb train --view: what the run's thread and the window's thread share, and the
// latter.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "tools/darb/live_curves.h"
#include "tools/darb/live_view.h"
#include "viewer/live_picture.h"
#include "viewer/window.h"

namespace darb {

/// The window has a thread and a device of its own; what both threads touch is behind the mutex.
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
    LiveDrawer drawer;  // of the run's thread
    LiveCurves curves;  // of the run's thread

    std::mutex mutex;
    std::condition_variable changed;
    ViewerWindow* window = nullptr;
    TrainingCurves training;  // as the run reports it; pause and steps as the user wants them
    std::optional<LiveScene> scene;
    std::filesystem::path model;
    int version = 0;  // of `training`
    bool closed = false, finished = false;
    std::atomic<bool> leave{false};  // the run failed
    std::string failure;             // why the window closed by itself

    int followed = 0;  // of the window's thread: the version that it shows
    std::chrono::steady_clock::time_point redrawn;
    bool begun = false, ended = false;
    std::thread thread;  // the last member: it uses all others
};

}  // namespace darb
