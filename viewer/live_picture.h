// SPDX-License-Identifier: MIT
// Pictures of a training run in a window of another thread. The window says what it wants to see.
// The run draws that on its own device between two iterations and hands the pixels over. While
// something holds the run up for seconds (compiling, a probe, an evaluation), the window stays
// alive and shows the last picture. Both threads may use a LivePicture; a LiveDrawer belongs to the
// run.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "viewer/input.h"
#include "viewer/pane_pictures.h"
#include "viewer/photo_compare.h"
#include "viewer/picture_pacing.h"

namespace darb {

/// What a window wants to see.
struct LiveWish {
    PictureKey key;  // the camera has the window's size; photo_beside: where it can be read
    WindowArea area;
    Panes panes;  // their lines, and whether they show the error
    bool operator==(const LiveWish& other) const;
};

/// How the splats that are being trained are meant to be shown.
struct LiveScene {
    int kernel = 0, sh_degree = 0;
    Footprint footprint = Footprint::psi;
    bool antialias = false, smoothing = false;
    bool operator==(const LiveScene&) const = default;
};
LiveScene live_scene(const GpuSplats& splats);

/// What the run drew for a wish.
struct LiveMade {
    std::vector<std::uint32_t> pixels;  // B8G8R8A8 [height][width]
    int width = 0, height = 0;          // px
    LiveScene scene;
    bool whole = false;  // false for a lesser picture in motion
    MotionQuality quality;
    std::vector<PassTime> passes;
    double ms = 0;  // without the work that the run had under way
    std::uint32_t visible = 0, intersections = 0;
    int photo = -1;     // the photo that was read; -1: none
    std::string error;  // why there is no photo or no picture
    std::vector<double> psnr_db;
};

class LivePicture {
  public:
    /// wake: called by the run's thread when there is something new.
    explicit LivePicture(std::function<void()> wake) : wake_(std::move(wake)) {}
    void wish(const LiveWish& wish);
    std::optional<LiveMade> take();

    std::optional<LiveWish> wished() const;
    void give(LiveMade made);

  private:
    std::function<void()> wake_;
    mutable std::mutex mutex_;
    std::optional<LiveWish> wish_;
    std::optional<LiveMade> made_;
};

/// What is asked of a run, as it waits for the run to take it. Any thread may use it.
class RunWishes {
  public:
    void ask(const std::vector<RunWish>& wishes);
    /// All of them in their order; none are left.
    std::vector<RunWish> take();
    bool empty() const;

  private:
    mutable std::mutex mutex_;
    std::vector<RunWish> waiting_;
};

/// How much the splats have changed since the last picture. `seldom`: they change all the time, and
/// not every change is drawn.
enum class LiveChange { none, seldom, at_once };

class LiveDrawer {
  public:
    LiveDrawer(Device& device, std::vector<View> views, const Bounds& bounds);

    /// Draws a picture where one is due: a lesser one as soon as the wish changes, the whole one
    /// when it stays the same, and another as the splats change. Returns whether it drew.
    bool draw(const GpuSplats& splats, LiveChange change, LivePicture& to);

  private:
    using LiveClock = std::chrono::steady_clock;
    LiveMade make(const GpuSplats& splats, const LiveWish& wish, bool whole);
    void read_photo(const LiveWish& wish, LiveMade& made);

    Device* device_;
    Bounds bounds_;
    SplatPicture picture_;
    PanePictures panes_;
    Photos photos_;
    MotionControl motion_;
    const GpuSplats* shown_ = nullptr;
    std::optional<LiveWish> drawn_;
    bool whole_ = false, compiled_ = false;  // about the last picture
    LiveClock::time_point drawn_at_, next_;
};

}  // namespace darb
