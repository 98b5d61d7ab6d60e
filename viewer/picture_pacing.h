// SPDX-License-Identifier: MIT
// PicturePacing: which picture a frame draws. In motion a lesser one, so that the frame rate keeps;
// the whole one a moment after the last change, in two steps where it takes long; nothing while
// nothing changes. It knows no device: who draws says what was drawn.
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

/// 1 and 1: the picture at rest.
struct MotionQuality {
    double scale = 1;   // share of the width and of the height, in eighths, at least 1/4
    double splats = 1;  // share of the splats, merged (motion_levels.h)
    bool operator==(const MotionQuality&) const = default;
};

/// What a frame took, by what its cost goes with.
struct MotionCost {
    double fixed_ms = 0;   // panels, presentation
    double splats_ms = 0;  // projection, depth sort
    double pixels_ms = 0;  // blending, display
    double total_ms() const { return fixed_ms + splats_ms + pixels_ms; }
};

/// From the times of the passes: what lies between splats and pixels (splat-tile intersections)
/// counts half for either. frame_ms: the whole frame.
MotionCost motion_cost(double frame_ms, std::span<const PassTime> passes);

/// Mean squared error of a picture in motion against the whole one, as a multiple of that of half
/// the splats: 2.5 (1 / scale^2 - 1) + 1 / splats - 1. Measured, docs/experiments/merging.md.
double motion_error(const MotionQuality& quality);

/// What a picture in motion may have of a scene, shares of its splats from `most` down by square
/// roots of 2; 10,000 splats cost little, and no share is of fewer. most: below 1.
std::vector<double> motion_shares(std::size_t splats, double most);

class MotionControl {
  public:
    /// target_ms: of a whole frame in motion.
    explicit MotionControl(double target_ms = 1000.0 / 30) : target_ms_(target_ms) {}

    MotionQuality quality() const { return quality_; }
    /// A frame drawn at quality() took this. Two slow frames in a row lower the quality, a dozen
    /// quick ones raise it, by at most twice the splats and pixels or the next there is.
    void measured(const MotionCost& cost);
    /// Another scene, of which nothing is known. shares: those below 1 that can be drawn, falling.
    void start(std::vector<double> shares);

  private:
    void choose(double room_ms);
    double target_ms_;
    std::vector<double> shares_;
    MotionQuality quality_{0.5, 1};
    int slow_ = 0, quick_ = 0;  // frames in a row
    MotionCost best_;           // of the quickest of those
};

/// What a picture depends on.
struct PictureKey {
    Camera camera;
    DisplaySettings display;
    int photo = -1;
    bool photo_beside = false;
    std::vector<int> kernels_beside;
    int version = 0;  // of the scene, its edits, its training
    bool operator==(const PictureKey& other) const;
};

/// What a frame draws. in_motion: at the quality of PicturePacing::motion; preview: all pixels, the
/// most important splats; rehearsal: what a first frame in motion needs, shown nowhere.
enum class PictureStep { none, in_motion, preview, whole, rehearsal };

class PicturePacing {
  public:
    using Time = std::chrono::steady_clock::time_point;

    struct Frame {
        bool whole_at_once = false;  // no lesser picture before
        bool works = false;          // the picture is one of an export or a measurement
        bool preview_pays = false;   // a whole picture takes long, a preview does not
        bool may_rehearse = false;   // and there is something to rehearse
    };
    PictureStep next(const PictureKey& key, const Frame& frame, Time now);
    /// A frame without a scene.
    void skip() { step_ = PictureStep::none; }
    /// The step was drawn, at this quality where it is in_motion.
    void drew(PictureStep step, const MotionQuality& quality);
    /// It could not be: not again before something changes.
    void failed();
    /// The one that was drawn last turned out to be none: another in its place.
    void miss() { missed_ = true; }
    bool missed() const { return missed_; }
    /// The picture is one of somebody else, or to be drawn again.
    void forget() { drawn_.reset(); }
    /// Of the last frame. Its time says how good the next may be.
    bool in_motion() const { return step_ == PictureStep::in_motion; }
    bool rehearses() const { return step_ == PictureStep::rehearsal; }

    /// It has all pixels, and the most important splats at least.
    bool refined() const;
    /// It is the whole one.
    bool is_whole() const;
    /// Seconds until the next picture is wanted; infinity where none is.
    double seconds_to_refine(Time now) const;

    /// The panels show a picture's times in the next frame, and have their size in the one after.
    static constexpr int kSettlingFrames = 2;
    /// Frames for the panels alone, from now on.
    void unsettle(int frames = kSettlingFrames) { unsettled_ = frames; }
    /// A frame is over: seconds until the panels want the next, 0 or infinity. A whole picture
    /// unsettles them.
    double count_still_frame();
    bool settled() const { return unsettled_ == 0; }

    MotionControl& motion() { return motion_; }
    const MotionControl& motion() const { return motion_; }

  private:
    bool is_drawn() const { return drawn_ && !missed_ && *drawn_ == last_; }
    MotionControl motion_;
    PictureKey last_;                  // of the last frame
    std::optional<PictureKey> drawn_;  // of the picture that there is
    PictureStep drawn_as_ = PictureStep::whole;
    bool all_pixels_ = true;  // of that picture
    bool missed_ = false;
    PictureStep step_ = PictureStep::none;
    int unsettled_ = kSettlingFrames;
    Time changed_at_ = std::chrono::steady_clock::now();
};

// MotionLevels: the levels of merged splats that are drawn in motion, made one after another by a
// thread of low priority while the viewer goes on with the most important splats. First all of them
// quickly, then again as near to the scene as they can be.

class MotionLevels {
  public:
    /// removed: splats that were deleted (1), empty or [N]; the model is copied. counts: falling.
    /// wake: called from the thread whenever there is something to take.
    MotionLevels(const SplatModel& model, const std::vector<std::uint8_t>& removed,
                 std::vector<std::size_t> counts, std::function<void()> wake);
    ~MotionLevels();  // cancels and waits
    MotionLevels(const MotionLevels&) = delete;
    MotionLevels& operator=(const MotionLevels&) = delete;

    void cancel() { cancelled_ = true; }
    /// The next level where it is ready: in the order of the counts, twice; of one count the later
    /// is the better one.
    std::optional<SplatModel> take();
    /// No more will come. Memory that does not suffice ends them early.
    bool done() const { return done_; }

  private:
    void run();
    void make_levels(bool quick);
    SplatModel model_;
    std::vector<std::size_t> counts_;
    std::function<void()> wake_;
    std::atomic<bool> cancelled_{false}, done_{false};
    std::mutex mutex_;  // of ready_
    std::deque<SplatModel> ready_;
    std::thread thread_;
};

// The end of the X server, or of the connection to it, as something that a program can go on after.

/// From now on *lost is set where libX11 would end the process; false where it has no such way (it
/// has since 1.7), or where windows do not come from it: Wayland closes them by itself. After the
/// loss waiting for events without a limit never returns; what is asked of the display does
/// nothing. *lost outlives the window system. A WindowSystem is there.
bool survive_display_loss(std::atomic<bool>& lost);

}  // namespace darb
