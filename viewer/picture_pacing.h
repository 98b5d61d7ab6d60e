// PicturePacing: which picture a frame draws. In motion a lesser one, so that the frame rate keeps;
// the whole one a moment after the last change, in two steps where it takes long; nothing while
// nothing changes. It knows no device: who draws says what was drawn.
#pragma once

#include <chrono>
#include <optional>
#include <vector>

#include "engine/scene/camera.h"
#include "viewer/display.h"
#include "viewer/motion.h"

namespace darb {

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

}  // namespace darb
