// SPDX-License-Identifier: MIT
// LiveLink: what a training run and a window say to each other. Each has a thread of its own: the
// run hands over what is new between two iterations and takes the user's wishes, and the window
// follows. The run draws the window's pictures, on its own device.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "trainer/run/run.h"
#include "viewer/bounds.h"
#include "viewer/live_picture.h"
#include "viewer/session.h"
#include "viewer/window.h"

namespace darb {

// What a live view of training shows besides the picture: curves of the run, bounds of its scene.

struct LiveCurves {
    /// Adds one step; thins the curves out as they get long.
    void add(const LiveStep& step, TrainingCurves& curves);

    float loss = 0, psnr_db = 0;  // smoothed
    int stride = 1;               // iterations for each value of a curve
    int last = 0;                 // the last iteration that was added
};

/// What a change that the window asks for means to the run. now: as the run has them.
RunChange change_of(const RunSettings& wanted, const RunSettings& now);
/// The settings that the window shows.
RunSettings settings_of(const TrainOptions& options);

/// The bounds of the sparse points that the cameras look at, or of the cameras where there are
/// none.
Bounds bounds_of(const Dataset& dataset);

class LiveLink {
  public:
    /// device: the run's. stop: set by others, ends a pause. wake: wakes the window, from any
    /// thread.
    LiveLink(Device& device, const Dataset& dataset, const std::atomic<bool>& stop,
             const std::function<void()>& wake);

    // In the thread of the run.

    /// Hands over what is new and draws a picture where one is due. It blocks while paused, until
    /// something is asked of the run, and returns how long that was with what was asked. Throws
    /// what drawing throws.
    LiveAnswer show(const LiveStep& step);
    /// Whether the user stopped the run and wants a web page of it.
    bool publishes() const { return publishes_; }
    /// The run is over: the window opens this scene and says this first; either may be empty.
    void finish(const std::filesystem::path& model, const std::string& said);
    /// Blocks until close() was called.
    void wait_until_let_go();

    // In the thread of the window.

    /// Passes the user's wishes to the run, and the run's reports to the user.
    void follow(ViewerWindow& shown);
    /// Whether the run is over and the window no longer uses the link's pictures.
    bool ended() const { return ended_; }
    /// The window no longer follows, or never will. Ends a pause.
    void close();
    bool closed() const;

  private:
    double wait_while_paused(const LiveStep& step);
    LiveAnswer take_wishes(double paused_s);

    Bounds bounds_;
    const std::atomic<bool>* stop_;
    std::function<void()> wake_;
    LivePicture picture_;
    LiveDrawer drawer_;  // of the run's thread, as the next two
    LiveCurves curves_;
    bool publishes_ = false;

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    TrainingCurves training_;  // what the run reports; pause and steps are the user's
    std::optional<LiveScene> scene_;
    std::filesystem::path model_;
    std::string last_words_;  // once the run is over
    RunWishes wishes_;
    int version_ = 0;  // version of `training_`
    bool closed_ = false, finished_ = false;

    int followed_ = 0;  // the version that the window shows; of its thread, as the rest
    std::chrono::steady_clock::time_point redrawn_;
    bool begun_ = false, ended_ = false;
};

}  // namespace darb
