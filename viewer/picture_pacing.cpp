#include "viewer/picture_pacing.h"

#include <algorithm>
#include <limits>

namespace darb {

namespace {

constexpr double kRest_s = 0.12;  // without change, before the picture is refined
constexpr double kForever = std::numeric_limits<double>::infinity();

double seconds_between(PicturePacing::Time from, PicturePacing::Time to) {
    return std::chrono::duration<double>(to - from).count();
}

}  // namespace

bool PictureKey::operator==(const PictureKey& o) const {
    const Camera &a = camera, &b = o.camera;
    return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
           a.cx == b.cx && a.cy == b.cy && a.rotation == b.rotation &&
           a.translation == b.translation && display == o.display && photo == o.photo &&
           photo_beside == o.photo_beside && kernels_beside == o.kernels_beside &&
           version == o.version;
}

PictureStep PicturePacing::next(const PictureKey& key, const Frame& frame, Time now) {
    last_.version = key.version;  // an edit or a training step is no motion
    if (!(key == last_)) changed_at_ = now;
    last_ = key;
    const bool refine =
        frame.whole_at_once || !drawn_ || seconds_between(changed_at_, now) >= kRest_s;
    step_ = PictureStep::none;
    if (frame.works) return step_;  // its pictures are shown as they come
    if (is_whole()) {
        if (frame.may_rehearse && !frame.whole_at_once) step_ = PictureStep::rehearsal;
    } else if (!refine) {
        if (!is_drawn()) step_ = PictureStep::in_motion;
    } else if (frame.preview_pays && !frame.whole_at_once && !refined()) {
        step_ = PictureStep::preview;
    } else {
        step_ = PictureStep::whole;
    }
    return step_;
}

void PicturePacing::drew(PictureStep step, const MotionQuality& quality) {
    drawn_ = last_;
    missed_ = false;
    drawn_as_ = step;
    all_pixels_ = step != PictureStep::in_motion || quality.scale == 1;
}

void PicturePacing::failed() {
    drawn_ = last_;
    missed_ = false;
    drawn_as_ = PictureStep::whole;
    all_pixels_ = true;
}

bool PicturePacing::refined() const {
    return is_drawn() && all_pixels_;
}

bool PicturePacing::is_whole() const {
    return is_drawn() && drawn_as_ == PictureStep::whole;
}

double PicturePacing::seconds_to_refine(Time now) const {
    if (drawn_as_ == PictureStep::whole) return kForever;
    return std::max(0.001, kRest_s - seconds_between(changed_at_, now));
}

double PicturePacing::count_still_frame() {
    unsettled_ = step_ == PictureStep::whole ? kSettlingFrames : std::max(unsettled_ - 1, 0);
    return unsettled_ > 0 ? 0 : kForever;
}

}  // namespace darb
