// The picture of a frame: drawn as its pacing wants it, and measured.
#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "viewer/seconds.h"
#include "viewer/view_camera.h"
#include "viewer/viewer.h"

namespace darb {

namespace {

constexpr double kLong_ms = 500;            // for a whole picture
constexpr std::size_t kFewSplats = 20'000;  // half of them are always drawn
constexpr double kQuick_ms = 20;            // it will be drawn in motion, too
constexpr size_t kTimesKept = 60;           // frames in motion that the panel averages over
constexpr int kRehearsals = 9;              // of motion; the first compiles
constexpr double kRehearsing_ms = 40;       // of a frame: the window is to answer meanwhile

double milliseconds_since(std::chrono::steady_clock::time_point start) {
    return 1000 * seconds_since(start);
}

}  // namespace

// Where a picture in motion cannot have all splats. Another scene and edits end them.
void Viewer::start_levels() {
    if (levels_ || !session_.scene || shares_.empty() || !pacing_.is_whole()) return;
    if (session_.edit.selected_count() > 0 || session_.edit.transforms()) return;  // they have none
    if (pacing_.motion().quality().splats == 1 || session_.times.full_ms < kQuick_ms) return;
    const Scene& s = *session_.scene;
    if (s.model.size() < kFewSplats) return;
    std::vector<std::size_t> counts;
    for (const double share : shares_)
        counts.push_back(static_cast<std::size_t>(share * static_cast<double>(s.model.size())));
    levels_ =
        std::make_unique<MotionLevels>(s.model, session_.edit.unseen(), counts, options_.wake);
}

void Viewer::take_levels() {
    std::erase_if(ended_, [](const auto& job) { return job->done(); });
    if (!levels_ || picture_.levels_ended()) return;
    const bool done = levels_->done();
    try {
        while (const std::optional<SplatModel> level = levels_->take()) picture_.add_level(*level);
    } catch (const NoRoom&) {  // no room: the important splats do without it
        levels_->cancel();
    }
    if (done) picture_.end_levels();
}

void Viewer::lose_levels() {
    if (!levels_) return;
    levels_->cancel();
    ended_.push_back(std::move(levels_));
}

bool Viewer::levels_ready() const {
    return picture_.levels_ended() || !levels_;
}

void Viewer::load_current_photo() {
    Photos& p = session_.photos;
    const bool wanted = p.compare || session_.display.mode == VIEW_ERROR;
    if (live_ != nullptr) return;  // whoever draws reads it
    if (p.current < 0 || !wanted || p.loaded == p.current || p.failed) return;
    if (attempt([&] { load_photo_of_view(*device_, p); })) {
        ++version_;
        return;
    }
    p.failed = true;
    p.compare = false;
    if (session_.display.mode == VIEW_ERROR) session_.display.mode = VIEW_COLOUR;
}

void Viewer::pace_picture(int width, int height, bool full, bool works) {
    const Photos& photos = session_.photos;
    const PictureKey key{
        camera_in_window(photos, session_.navigation, free_area(session_, width, height)),
        session_.display,
        photos.current,
        photo_beside(photos, session_.display),
        session_.panes.kernels,
        version_};
    if (!ready_to_move()) rehearsals_ = kRehearsals;
    const PicturePacing::Frame frame{
        full, works,
        session_.times.full_ms > kLong_ms && picture_.most_moving() < 1 && ready_to_move(),
        session_.error.empty() && rehearsals_ > 0};
    const PictureStep step = pacing_.next(key, frame, frame_start_);
    if (step == PictureStep::rehearsal)
        rehearse_motion(key);
    else if (step != PictureStep::none)
        draw_picture(key, step);
    compose_panes();
    if (!works) start_levels();
}

std::vector<DisplaySettings> Viewer::shown_displays() const {
    return pane_displays(session_.display, kernels_beside(session_.panes, session_.display.kernel));
}

bool Viewer::ready_to_move() const {
    const std::vector<DisplaySettings> displays = shown_displays();
    for (size_t i = 0; i < displays.size(); ++i)
        if (!picture_.ready_to_move(displays[i], static_cast<int>(i))) return false;
    return true;
}

void Viewer::render_shown(const Camera& camera, const WindowArea& area,
                          std::optional<double> moving) {
    const std::vector<DisplaySettings> displays = shown_displays();
    const bool photo_first = photo_beside(session_.photos, session_.display);
    shows_panes_ = photo_first || displays.size() > 1;  // also where it fails
    panes_.render_all(picture_, camera, displays, overlay_of(session_.photos, camera, area),
                      photo_first, moving);
}

void Viewer::compose_panes() {
    const WindowArea area = free_area(session_, canvas_.width(), canvas_.height());
    fit_lines(shows_panes_ ? panes_.count() : 0, session_.panes,
              compared_strip(session_.photos, session_.display, area));
    if (shows_panes_) attempt([&] { panes_.compose(session_.panes); });
}

BufferPicture Viewer::shown() const {
    if ((picture_.empty() || warm_up_) && live_size_.x > 0)
        return {&live_pixels_, live_size_.x, live_size_.y};
    return drawn();
}

BufferPicture Viewer::drawn() const {
    if (picture_.empty()) return {};
    if (shows_panes_) return {&panes_.pixels(), panes_.width(), panes_.height()};
    return {&picture_.pixels(), picture_.width(), picture_.height()};
}

// All but the whole one are replaced soon.
void Viewer::draw_picture(const PictureKey& key, PictureStep step) {
    const auto start = Clock::now();
    const bool whole = step == PictureStep::whole;
    const MotionQuality quality = whole ? MotionQuality()
                                  : step == PictureStep::preview
                                      ? MotionQuality{1, picture_.most_moving()}
                                      : pacing_.motion().quality();
    const Camera camera = at_scale(key.camera, quality.scale);
    pacing_.drew(step, quality);
    if (step == PictureStep::in_motion) rehearsals_ = 0;  // it measures the same
    const bool drawn = attempt([&] {
        render_shown(camera, free_area(session_, key.camera.width, key.camera.height),
                     whole ? std::nullopt : std::optional(quality.splats));
    });
    session_.panes.psnr_db.clear();
    if (!drawn) return pacing_.failed();
    FrameTimes& t = session_.times;
    t.passes = shows_panes_ ? panes_.pass_times() : picture_.pass_times();
    t.picture_ms = milliseconds_since(start);
    if (whole && shows_panes_) session_.panes.psnr_db = panes_.psnr_db();
    if (whole) t.full_ms = t.picture_ms;
    t.quality = quality;
    t.visible = picture_.status().visible;
    t.intersections = picture_.status().intersections;
    if (session_.plan && whole)
        session_.plan->note_frame(picture_.status().huge_splats, picture_.status().longest_list);
}

// After what a picture needs has changed: pipelines compile at their first use, and the first
// frames in motion are drawn at a quality that was found before them.
void Viewer::rehearse_motion(const PictureKey& key) {
    const auto begin = Clock::now();
    const bool first = rehearsals_ == kRehearsals;
    const FrameTimes& t = session_.times;
    if (first) besides_picture_ms_ = std::max(0.0, t.frame_ms - t.picture_ms);
    attempt([&] {
        do {
            const MotionQuality quality = pacing_.motion().quality();
            // The first makes the copy of the important splats, also where all are wanted now.
            rehearse_once(key, quality,
                          rehearsals_ == kRehearsals
                              ? std::min(quality.splats, picture_.most_moving())
                              : quality.splats);
        } while (--rehearsals_ > 0 && !first && milliseconds_since(begin) < kRehearsing_ms);
    });
}

void Viewer::rehearse_once(const PictureKey& key, const MotionQuality& quality, double splats) {
    const auto start = Clock::now();
    const std::vector<DisplaySettings> displays = shown_displays();
    std::vector<PassTime> passes;
    bool compiled = false;
    for (size_t p = 0; p < displays.size(); ++p) {
        add_times(picture_.rehearse(at_scale(key.camera, quality.scale), displays[p], splats,
                                    static_cast<int>(p)),
                  passes);
        compiled |= picture_.compiled();
    }
    if (compiled || splats < quality.splats) return;
    pacing_.motion().measured(motion_cost(besides_picture_ms_ + milliseconds_since(start), passes));
}

void Viewer::presented() {
    FrameTimes& t = session_.times;
    t.frame_ms = milliseconds_since(frame_start_);
    if (!pacing_.in_motion() || (shows_panes_ ? panes_.compiled() : picture_.compiled())) return;
    pacing_.motion().measured(motion_cost(t.frame_ms, t.passes));
    t.moving_ms.push_back(t.frame_ms);
    if (t.moving_ms.size() > kTimesKept) t.moving_ms.pop_front();
}

}  // namespace darb
