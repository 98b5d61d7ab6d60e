// The picture of a frame: drawn as its pacing wants it, and measured.
#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "viewer/viewer.h"

namespace darb {

namespace {

constexpr double kLong_ms = 500;            // for a whole picture
constexpr std::size_t kFewSplats = 20'000;  // half of them are always drawn
constexpr double kQuick_ms = 20;            // it will be drawn in motion, too
constexpr size_t kTimesKept = 60;           // frames in motion that the panel averages over
constexpr int kRehearsals = 8;              // of motion, after the one that compiles

double milliseconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

Camera scaled(const Camera& camera, double scale) {
    const auto px = [&](int full) {
        return std::max(1, static_cast<int>(std::lround(full * scale)));
    };
    return resized(camera, px(camera.width), px(camera.height));
}

}  // namespace

// Where a picture in motion cannot have all splats. Another scene and edits end them.
void Viewer::start_levels() {
    if (levels_ || !session_.scene || shares_.empty() || !pacing_.is_whole()) return;
    if (pacing_.motion().quality().splats == 1 || session_.times.full_ms < kQuick_ms) return;
    const Scene& s = *session_.scene;
    if (s.model.size() < kFewSplats) return;
    std::vector<std::size_t> counts;
    for (const double share : shares_)
        counts.push_back(static_cast<std::size_t>(share * static_cast<double>(s.model.size())));
    levels_ =
        std::make_unique<MotionLevels>(s.model, session_.edit.removed(), counts, options_.wake);
}

void Viewer::take_levels() {
    std::erase_if(ended_, [](const auto& job) { return job->done(); });
    if (!levels_ || picture_.levels_ended()) return;
    const bool done = levels_->done();
    try {
        while (const std::optional<SplatModel> level = levels_->take()) picture_.add_level(*level);
    } catch (const Error&) {  // no room: the important splats do without it
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
    const PictureKey key{camera_in_window(photos, session_.navigation, width, height),
                         session_.display, photos.current, photos.compare ? photos.split : 0.0f,
                         version_};
    const bool ready = picture_.ready_to_move(session_.display);
    const PicturePacing::Frame frame{
        full, works, session_.times.full_ms > kLong_ms && picture_.most_moving() < 1 && ready,
        session_.error.empty() && !ready};
    const PictureStep step = pacing_.next(key, frame, frame_start_);
    if (step == PictureStep::rehearsal)
        rehearse_motion(key);
    else if (step != PictureStep::none)
        draw_picture(key, step);
    if (!works) start_levels();
}

// All but the whole one are replaced soon.
void Viewer::draw_picture(const PictureKey& key, PictureStep step) {
    const auto start = Clock::now();
    const bool whole = step == PictureStep::whole;
    const MotionQuality quality = whole ? MotionQuality()
                                  : step == PictureStep::preview
                                      ? MotionQuality{1, picture_.most_moving()}
                                      : pacing_.motion().quality();
    const Camera camera = scaled(key.camera, quality.scale);
    pacing_.drew(step, quality);
    const bool drawn = attempt([&] {
        picture_.render(camera, key.display,
                        overlay_of(session_.photos, camera, key.camera.width, key.camera.height),
                        whole ? std::nullopt : std::optional(quality.splats));
    });
    if (!drawn) return pacing_.failed();
    FrameTimes& t = session_.times;
    t.passes = picture_.pass_times();
    t.picture_ms = milliseconds_since(start);
    if (whole) t.full_ms = t.picture_ms;
    t.quality = quality;
    t.visible = picture_.status().visible;
    t.intersections = picture_.status().intersections;
    if (session_.plan && whole)
        session_.plan->note_frame(picture_.status().huge_splats, picture_.status().longest_list);
}

// Once after what a picture needs has changed: pipelines compile at their first use, and the first
// frames in motion are drawn at a quality that was found before them.
void Viewer::rehearse_motion(const PictureKey& key) {
    const FrameTimes& t = session_.times;
    const double besides_ms = std::max(0.0, t.frame_ms - t.picture_ms);
    attempt([&] {
        for (int i = 0; i <= kRehearsals; ++i) {
            const MotionQuality quality = pacing_.motion().quality();
            // The first makes the copy of the important splats, also where all are wanted now.
            const double splats =
                i == 0 ? std::min(quality.splats, picture_.most_moving()) : quality.splats;
            const auto start = Clock::now();
            const std::vector<PassTime> passes =
                picture_.rehearse(scaled(key.camera, quality.scale), key.display, splats);
            if (picture_.compiled() || splats < quality.splats) continue;
            pacing_.motion().measured(motion_cost(besides_ms + milliseconds_since(start), passes));
        }
    });
}

void Viewer::presented() {
    FrameTimes& t = session_.times;
    t.frame_ms = milliseconds_since(frame_start_);
    if (!pacing_.in_motion() || picture_.compiled()) return;
    pacing_.motion().measured(motion_cost(t.frame_ms, t.passes));
    t.moving_ms.push_back(t.frame_ms);
    if (t.moving_ms.size() > kTimesKept) t.moving_ms.pop_front();
}

}  // namespace darb
