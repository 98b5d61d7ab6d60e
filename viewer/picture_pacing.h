// SPDX-License-Identifier: MIT
// PicturePacing: decides which picture a frame draws. In motion it is a lesser one, which keeps the
// frame rate. A moment after the last change it is the whole one, in two steps where that takes
// long. While nothing changes it is none. The class knows no device; whoever draws reports what was
// drawn.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "viewer/display.h"

namespace darb {

/// The defaults mean the picture at rest.
struct MotionQuality {
    double scale = 1;   // share of the width and of the height, in eighths, at least 1/4
    double splats = 1;  // share of the splats, which are merged (motion_levels.h)
    bool operator==(const MotionQuality&) const = default;
};

/// The time that a frame took, split by what each part depends on.
struct MotionCost {
    double fixed_ms = 0;   // panels, presentation
    double splats_ms = 0;  // projection, depth sort
    double pixels_ms = 0;  // blending, display
    double total_ms() const { return fixed_ms + splats_ms + pixels_ms; }
};

/// Splits the frame's time by the times of its passes. What lies between splats and pixels
/// (splat-tile intersections) counts half for either. frame_ms: the whole frame.
MotionCost motion_cost(double frame_ms, std::span<const PassTime> passes);

/// Mean squared error of a picture in motion against the whole one, as a multiple of the error with
/// half the splats: 2.5 (1 / scale^2 - 1) + 1 / splats - 1. Measured in
/// docs/experiments/merging.md.
double motion_error(const MotionQuality& quality);

/// The shares of a scene's splats that a picture in motion may have: from `most`, which is below 1,
/// down by square roots of 2. No share has fewer than 10,000 splats, as those cost little.
std::vector<double> motion_shares(std::size_t splats, double most);

class MotionControl {
  public:
    /// target_ms: for a whole frame in motion.
    explicit MotionControl(double target_ms = 1000.0 / 30) : target_ms_(target_ms) {}

    MotionQuality quality() const { return quality_; }
    /// Takes the cost of a frame that was drawn at quality(). Two slow frames in a row lower the
    /// quality. A dozen quick ones raise it, by at most twice the splats and pixels or to the next
    /// step there is.
    void measured(const MotionCost& cost);
    /// Starts with a scene of which nothing is known. shares: those below 1 that can be drawn,
    /// falling.
    void start(std::vector<double> shares);

  private:
    void choose(double room_ms);
    double target_ms_;
    std::vector<double> shares_;
    MotionQuality quality_{0.5, 1};
    int slow_ = 0, quick_ = 0;  // frames in a row
    MotionCost best_;           // the cost of the quickest of those
};

/// What a picture depends on.
struct PictureKey {
    Camera camera;
    DisplaySettings display;
    int photo = -1;
    bool photo_beside = false;
    std::vector<int> kernels_beside;
    int version = 0;  // counts changes of the scene, its edits, its training
    bool operator==(const PictureKey& other) const;
};

/// What a frame draws. in_motion: at the quality of PicturePacing::motion; preview: all pixels but
/// only the most important splats; rehearsal: what a first frame in motion needs, shown nowhere.
enum class PictureStep { none, in_motion, preview, whole, rehearsal };

class PicturePacing {
  public:
    using Time = std::chrono::steady_clock::time_point;

    struct Frame {
        bool whole_at_once = false;  // without a lesser picture before
        bool works = false;          // the picture belongs to an export or a measurement
        bool preview_pays = false;   // a whole picture takes long and a preview does not
        bool may_rehearse = false;   // rehearsing is allowed and there is something to rehearse
    };
    PictureStep next(const PictureKey& key, const Frame& frame, Time now);
    /// To be called in a frame without a scene.
    void skip() { step_ = PictureStep::none; }
    /// Reports that the step was drawn, at this quality where it is in_motion.
    void drew(PictureStep step, const MotionQuality& quality);
    /// Reports that drawing failed; it is not tried again before something changes.
    void failed();
    /// Reports that the picture drawn last turned out to be missing, so that another takes its
    /// place.
    void miss() { missed_ = true; }
    bool missed() const { return missed_; }
    /// Draws again next time: the current picture was drawn by others, or is out of date.
    void forget() { drawn_.reset(); }
    /// Whether the last frame was in motion. Its time then says how good the next may be.
    bool in_motion() const { return step_ == PictureStep::in_motion; }
    bool rehearses() const { return step_ == PictureStep::rehearsal; }

    /// Whether the picture has all pixels, and at least the most important splats.
    bool refined() const;
    /// Whether it is the whole picture.
    bool is_whole() const;
    /// Seconds until the next picture is wanted; infinity where none is.
    double seconds_to_refine(Time now) const;

    /// A picture's times appear in the panels in the next frame, and the panels have their size one
    /// later.
    static constexpr int kSettlingFrames = 2;
    /// Asks for this many frames for the panels alone.
    void unsettle(int frames = kSettlingFrames) { unsettled_ = frames; }
    /// Counts a frame in which nothing moved. Returns the seconds until the panels want the next
    /// one, 0 or infinity. A whole picture unsettles the panels.
    double count_still_frame();
    bool settled() const { return unsettled_ == 0; }

    MotionControl& motion() { return motion_; }
    const MotionControl& motion() const { return motion_; }

  private:
    bool is_drawn() const { return drawn_ && !missed_ && *drawn_ == last_; }
    MotionControl motion_;
    PictureKey last_;                  // key of the last frame
    std::optional<PictureKey> drawn_;  // key of the picture that there is
    PictureStep drawn_as_ = PictureStep::whole;
    bool all_pixels_ = true;  // whether that picture has them
    bool missed_ = false;
    PictureStep step_ = PictureStep::none;
    int unsettled_ = kSettlingFrames;
    Time changed_at_ = std::chrono::steady_clock::now();
};

// MotionLevels: the levels of merged splats that are drawn in motion. A thread of low priority
// makes one after another while the viewer goes on with the most important splats. It first makes
// all levels quickly, then each again as near to the scene as possible.

class MotionLevels {
  public:
    /// removed: splats that were deleted (1), empty or [N]. The model is copied. counts: falling.
    /// wake: called from the thread whenever there is something to take.
    MotionLevels(const SplatModel& model, const std::vector<std::uint8_t>& removed,
                 std::vector<std::size_t> counts, std::function<void()> wake);
    ~MotionLevels();  // cancels and waits
    MotionLevels(const MotionLevels&) = delete;
    MotionLevels& operator=(const MotionLevels&) = delete;

    void cancel() { cancelled_ = true; }
    /// The next level where it is ready. They come twice, in the order of the counts; for the same
    /// count the later one is better.
    std::optional<SplatModel> take();
    /// Whether no more will come. Running out of memory ends them early.
    bool done() const { return done_; }

  private:
    void run();
    void make_levels(bool quick);
    SplatModel model_;
    std::vector<std::size_t> counts_;
    std::function<void()> wake_;
    std::atomic<bool> cancelled_{false}, done_{false};
    std::mutex mutex_;  // guards ready_
    std::deque<SplatModel> ready_;
    std::thread thread_;
};

// Makes the end of the X server, or of the connection to it, something that a program can survive.

/// From now on *lost is set where libX11 would end the process. Returns false where it offers no
/// way to do so (it has since 1.7), or where windows do not come from X11: Wayland closes them by
/// itself. After the loss, waiting for events without a limit never returns, and requests to the
/// display do nothing. *lost must outlive the window system, and a WindowSystem must exist.
bool survive_display_loss(std::atomic<bool>& lost);

}  // namespace darb
