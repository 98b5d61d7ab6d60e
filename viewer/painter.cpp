// SPDX-License-Identifier: MIT
// Makes the pictures of a scene as each frame's pacing wants them, and measures what they cost.
#include "viewer/painter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "viewer/seconds.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr double kLong_ms = 500;            // more is long for a whole picture
constexpr std::size_t kFewSplats = 20'000;  // half of so few splats are always drawn
constexpr double kQuick_ms = 20;            // quick enough to be drawn in motion, too
constexpr size_t kTimesKept = 60;           // frames in motion over which the panel averages
constexpr int kRehearsals = 9;              // rehearsals of motion; the first one compiles

double milliseconds_since(std::chrono::steady_clock::time_point start) {
    return 1000 * seconds_since(start);
}

double sum_ms(const std::vector<PassTime>& passes) {
    double sum = 0;
    for (const PassTime& pass : passes) sum += pass.ms;
    return sum;
}

}  // namespace

void LivePixels::set(Device& device, const LiveMade& made) {
    if (std::exchange(composed, false)) at = (at + 1) % buffers.size();
    const std::uint64_t bytes = made.pixels.size() * 4;
    if (buffers[at].bytes() < bytes)
        buffers[at] = Buffer(device, "live picture", bytes, Memory::host);
    std::memcpy(buffers[at].mapped(), made.pixels.data(), bytes);
    size = {made.width, made.height};
}

Painter::Painter(Device& device, Session& session, PainterOptions options, GLFWwindow* window)
    : device_(&device),
      session_(&session),
      options_(std::move(options)),
      canvas_(device),
      gui_(device, canvas_.render_pass(), options_.gui_scale, window),
      picture_(device),
      panes_(device) {}

Painter::~Painter() {
    finish_quietly(*device_);
}

void Painter::open(const Scene& scene) {
    picture_.set_scene(scene.shown(), scene.bounds, scene.important);
    work_.cancel_mesh();  // it was of another scene
    if (session_->mesh) close_mesh();
    under_way_.clear();
    copies_.at = 0;
    warm_up_.thread.reset();
    lose_scene("another scene was opened");
    begin_motion();
    shown_model_ = shown_edit_ = 0;
}

void Painter::show_mesh(ShownMesh mesh, bool alone) {
    picture_.set_mesh(&mesh.mesh);
    session_->mesh = std::make_unique<ShownMesh>(std::move(mesh));
    MeshShow& shown = session_->display.mesh;
    if (alone)
        shown = MeshShow::alone;
    else if (shown == MeshShow::none)
        shown = MeshShow::both;
    ++version_;
}

void Painter::close_mesh() {
    picture_.set_mesh(nullptr);
    session_->mesh.reset();
    session_->display.mesh = MeshShow::none;
    ++version_;
}

void Painter::start_mesh_of_scene() {
    std::vector<View> views;
    for (const View& view : session_->photos.views)  // without the photos
        views.emplace_back().camera = view.camera;
    start_mesh([device = options_.second_device.value_or(DeviceOptions()),
                tuning = device_->tuning(), model = session_->edit.apply(session_->scene->model),
                views = std::move(views),
                wish = session_->mesh_wish](const MeshProgress& progress) {
        return make_shown_mesh(device, tuning, model, views, wish, progress);
    });
}

void Painter::take_mesh(bool wait) {
    std::optional<ShownMesh> mesh = work_.take_mesh(wait);
    if (!mesh) return;
    std::string said = fmt::format("a mesh of {} faces", count_text(mesh->mesh.face_count()));
    for (const std::string& note : mesh->notes) said += "\n" + note;
    show_mesh(std::move(*mesh));
    session_->tell(said);
}

void Painter::finish_mesh() {
    take_mesh(true);
    note_mesh();
}

void Painter::note_mesh() {
    session_->progress.mesh = work_.mesh_share();
    session_->progress.mesh_stage = "mesh: " + work_.mesh_stage();
}

void Painter::begin_motion() {
    shares_ = picture_.most_moving() < 1
                  ? motion_shares(picture_.splat_count(), picture_.most_moving())
                  : std::vector<double>();
    pacing_.motion().start(shares_);
}

// Until the warm-up is over, the run's last picture stays and the window remains usable.
void Painter::begin_scene(bool of_run) {
    constexpr int kSize = 256;  // px
    if (of_run && options_.second_device && live_.size.x > 0)
        warm_up_.thread = std::make_unique<WarmUp>(
            *device_, *options_.second_device, session_->scene->shown(), shown_displays(),
            session_->navigation.camera(kSize, kSize), options_.wake);
    else
        live_.size = {0, 0};
}

void Painter::end_warm_up() {
    warm_up_.pipelines = warm_up_.thread->take_pipelines();
    warm_up_.thread.reset();
    live_.size = {0, 0};
    pacing_.forget();
}

// All frames of an export, and all pictures of a measurement, show one scene.
void Painter::lose_scene(const char* why) {
    const std::string note = work_.lose_scene(why);
    if (!note.empty()) session_->tell(note);
    lose_levels();
    ++version_;
}

// While a hand moves splats, only those are updated; everything else follows when it lets go.
void Painter::show_edits() {
    const Edit& edit = session_->edit;
    const Scene& scene = *session_->scene;
    if (std::exchange(shown_edit_, edit.seen_version()) != edit.seen_version())
        lose_scene("the scene was edited");
    if (edit.model_version() != shown_model_) {
        if (edit.transforms()) {
            picture_.update_scene();
        } else {
            picture_.set_scene(scene.shown(), scene.bounds, scene.important);
            begin_motion();
        }
        shown_model_ = edit.model_version();
    }
    show_marks(!work_.draws());
}

// The highlight of a selection is for the user who edits, so pictures that are written or measured
// have none.
void Painter::show_marks(bool highlight) {
    const Edit& edit = session_->edit;
    highlights_ = highlight;
    lose_levels();  // levels have no marks
    ++version_;
    picture_.set_marks(edit.unseen(),
                       highlight ? edit.selected() : SplatSet(edit.selected().size(), 0));
}

void Painter::begin_run() {
    picture_.clear();
    work_.cancel_mesh();
    if (session_->mesh) close_mesh();
    under_way_.clear();
    copies_.at = 0;
    warm_up_.thread.reset();
    lose_scene("a training run began");
    shown_model_ = shown_edit_ = 0;
    shares_.clear();
    pacing_.motion().start({});
}

void Painter::show_picture_of_run(const LiveMade& made) {
    if (made.pixels.empty()) return;
    live_.set(*device_, made);
    session_->panes.psnr_db = made.psnr_db;
    FrameTimes& t = session_->times;
    t.passes = made.passes;
    t.picture_ms = made.ms;
    t.quality = made.quality;
    if (made.whole) t.full_ms = made.ms;
    t.visible = made.visible;
    t.intersections = made.intersections;
}

void Painter::begin(int width, int height) {
    frame_start_ = Clock::now();
    ++frame_;
    canvas_.begin_frame();
    picture_.finish(frame_ - kFramesUnderWay);
    take_results();
    take_psnr();
    take_levels();
    if (warm_up_.thread && warm_up_.thread->done()) end_warm_up();
    if (at_rest()) warm_up_.pipelines.clear();  // the pictures own them now
    canvas_.resize(width, height);
    gui_.begin(width, height);
}

void Painter::paint(const PaintedFrame& frame) {
    const bool works = work_.draws();
    step_work();
    if (!frame.of_run) load_current_photo();  // for a run, whoever draws reads it
    pacing_.skip();
    if (!frame.of_run && !picture_.empty() && !warm_up_.thread) pace_picture(frame, works);
}

double Painter::seconds_to_next() {
    if (!under_way_.empty() || copies_.at > 0) return 0;
    if (pacing_.missed() && !picture_.empty()) return 0;
    if (pacing_.rehearses() && rehearsals_ > 0) return 0;
    const double refine_s = pacing_.seconds_to_refine(frame_start_);
    if (!picture_.empty() && std::isfinite(refine_s)) return refine_s;
    return pacing_.count_still_frame();
}

bool Painter::refined() const {
    return pacing_.refined() && std::none_of(under_way_.begin(), under_way_.end(),
                                             [](const Started& s) { return s.refines; });
}

bool Painter::at_rest() const {
    return !warm_up_.thread && under_way_.empty() && pacing_.is_whole() && ready_to_move() &&
           rehearsals_ == 0;
}

void Painter::compose() {
    const auto strips = [this](Commands& commands) {
        if (shows_panes_) panes_.record(commands, session_->panes);
        if (std::exchange(copies_.wanted, false)) {
            panes_.record_copies(commands);
            copies_.at = frame_ + kFramesUnderWay;
        }
    };
    live_.composed = true;
    canvas_.compose(shown(), session_->display.background, strips,
                    [this](VkCommandBuffer commands) { gui_.draw(commands); });
}

// Levels are made where a picture in motion cannot have all splats. Another scene or an edit ends
// them.
void Painter::start_levels() {
    if (levels_ || !session_->scene || shares_.empty() || !pacing_.is_whole()) return;
    if (session_->edit.selected_count() > 0 || session_->edit.transforms())
        return;  // levels show no selection and no drag
    if (pacing_.motion().quality().splats == 1 || session_->times.full_ms < kQuick_ms) return;
    const Scene& s = *session_->scene;
    if (s.model.size() < kFewSplats) return;
    std::vector<std::size_t> counts;
    for (const double share : shares_)
        counts.push_back(static_cast<std::size_t>(share * static_cast<double>(s.model.size())));
    levels_ =
        std::make_unique<MotionLevels>(s.shown(), session_->edit.unseen(), counts, options_.wake);
}

void Painter::take_levels() {
    std::erase_if(ended_, [](const auto& job) { return job->done(); });
    if (!levels_ || picture_.levels_ended()) return;
    const bool done = levels_->done();
    try {
        while (const std::optional<SplatModel> level = levels_->take()) picture_.add_level(*level);
    } catch (const NoRoom&) {  // the important splats do without levels
        levels_->cancel();
    }
    if (done) picture_.end_levels();
}

void Painter::lose_levels() {
    if (!levels_) return;
    levels_->cancel();
    ended_.push_back(std::move(levels_));
}

void Painter::load_current_photo() {
    Photos& p = session_->photos;
    const bool wanted = p.compare || session_->display.mode == VIEW_ERROR;
    if (p.current < 0 || !wanted || p.loaded == p.current || p.failed) return;
    if (session_->attempt([&] { load_photo_of_view(*device_, p); })) {
        ++version_;
        return;
    }
    p.failed = true;
    p.compare = false;
    if (session_->display.mode == VIEW_ERROR) session_->display.mode = VIEW_COLOUR;
}

void Painter::pace_picture(const PaintedFrame& frame, bool works) {
    const Photos& photos = session_->photos;
    const PictureKey key{camera_in_window(photos, session_->navigation,
                                          free_area(*session_, frame.width, frame.height)),
                         session_->display,
                         photos.current,
                         photo_beside(photos, session_->display),
                         session_->panes.kernels,
                         version_};
    if (!ready_to_move()) rehearsals_ = kRehearsals;
    const PicturePacing::Frame paced{
        frame.full, works,
        session_->times.full_ms > kLong_ms && picture_.most_moving() < 1 && ready_to_move(),
        session_->error.empty() && rehearsals_ > 0 && under_way_.empty()};
    const PictureStep step = pacing_.next(key, paced, frame_start_);
    if (step == PictureStep::rehearsal)
        rehearse_motion(key);
    else if (step != PictureStep::none)
        draw_picture(key, step, frame.full);
    fit_panes();
    if (!works) start_levels();
}

std::vector<DisplaySettings> Painter::shown_displays() const {
    DisplaySettings display = session_->display;
    const bool beside = display.mesh == MeshShow::beside && picture_.has_mesh();
    if (display.mesh == MeshShow::beside) display.mesh = MeshShow::none;
    std::vector<DisplaySettings> displays =
        pane_displays(display, kernels_beside(session_->panes, display.kernel));
    if (beside) displays.emplace_back(display).mesh = MeshShow::alone;
    return displays;
}

bool Painter::ready_to_move() const {
    const std::vector<DisplaySettings> displays = shown_displays();
    for (size_t i = 0; i < displays.size(); ++i)
        if (!picture_.ready_to_move(displays[i], static_cast<int>(i))) return false;
    return true;
}

PaneWish Painter::wish_for(const Camera& camera, const WindowArea& area,
                           std::optional<double> moving) const {
    return {camera, shown_displays(), overlay_of(session_->photos, camera, area),
            photo_beside(session_->photos, session_->display), moving};
}

void Painter::fit_panes() {
    const WindowArea area = free_area(*session_, canvas_.width(), canvas_.height());
    fit_lines(shows_panes_ ? panes_.count() : 0, session_->panes,
              compared_strip(session_->photos, session_->display, area));
}

BufferPicture Painter::shown() const {
    if ((picture_.empty() || warm_up_.thread) && live_.size.x > 0)
        return {&live_.buffers[live_.at], live_.size.x, live_.size.y};
    return drawn();
}

BufferPicture Painter::drawn() const {
    if (picture_.empty()) return {};
    if (shows_panes_) return {&panes_.pixels(), panes_.width(), panes_.height()};
    return {&picture_.pixels(), picture_.width(), picture_.height()};
}

// All pictures but the whole one are replaced soon.
void Painter::draw_picture(const PictureKey& key, PictureStep step, bool wait) {
    const bool whole = step == PictureStep::whole;
    const MotionQuality quality = whole ? MotionQuality()
                                  : step == PictureStep::preview
                                      ? MotionQuality{1, picture_.most_moving()}
                                      : pacing_.motion().quality();
    const Camera camera = at_scale(key.camera, quality.scale);
    const bool refines = !pacing_.refined();
    pacing_.drew(step, quality);
    if (step == PictureStep::in_motion) rehearsals_ = 0;  // a picture in motion measures the same
    const WindowArea area = free_area(*session_, key.camera.width, key.camera.height);
    const PaneWish wish =
        wish_for(camera, area, whole ? std::nullopt : std::optional(quality.splats));
    Started started{.frame = frame_, .step = step, .quality = quality, .made = {}};
    session_->panes.psnr_db.clear();
    copies_.wanted = false;
    copies_.at = 0;
    if (!make_picture(wish, started, wait)) return pacing_.failed();
    session_->times.quality = quality;
    started.refines = refines;
    started.counts = !panes_.compiled();
    started.pictures = wish.displays.size();
    if (wait)
        note_picture(started, milliseconds_since(started.begun));
    else
        under_way_.push_back(std::move(started));
}

// Returns whether the picture could be made; otherwise it says why not.
bool Painter::make_picture(const PaneWish& wish, Started& started, bool wait) {
    started.begun = Clock::now();
    shows_panes_ = wish.several();  // also where it fails
    const bool whole_panes = shows_panes_ && started.step == PictureStep::whole;
    return session_->attempt([&] {
        if (!wait) {
            panes_.start(frame_, picture_, wish);
            copies_.wanted = whole_panes;
            return;
        }
        panes_.render(picture_, wish);
        started.made.status = picture_.status();
        started.made.passes = panes_.pass_times();
        if (!whole_panes) return;
        fit_panes();
        panes_.compose(session_->panes, true);
        session_->panes.psnr_db = panes_.psnr_db();
    });
}

void Painter::take_results() {
    for (StartedPicture& made : picture_.take_done()) {
        const auto of = std::find_if(under_way_.begin(), under_way_.end(),
                                     [&](const Started& s) { return s.frame == made.frame; });
        if (of == under_way_.end()) continue;  // it belongs to an earlier scene
        add_times(made.passes, of->made.passes);
        of->made.status = made.status;
        of->made.whole &= made.whole;
        if (!made.error.empty()) of->made.error = made.error;
        if (--of->pictures > 0) continue;
        const Started started = std::move(*of);
        under_way_.erase(of);
        take_result(started);
    }
}

void Painter::take_result(const Started& started) {
    const bool rehearsal = started.step == PictureStep::rehearsal;
    const bool last = std::all_of(under_way_.begin(), under_way_.end(), [](const Started& s) {
        return s.step == PictureStep::rehearsal;
    });
    if (!started.made.error.empty()) {
        session_->error = started.made.error;
        if (!rehearsal && last) pacing_.failed();
        return;
    }
    if (!started.made.whole) {  // draws it again, now that there is room
        if (rehearsal) ++rehearsals_;
        if (!rehearsal && last) pacing_.miss();
        return;
    }
    const std::vector<PassTime>& passes = started.made.passes;
    const double ms = passes.empty() ? milliseconds_since(started.begun) : sum_ms(passes);
    if (!rehearsal) note_picture(started, ms);
    // Another quality has been chosen since, so this time teaches nothing.
    if (!started.counts || !(started.quality == pacing_.motion().quality())) return;
    if (rehearsal)
        pacing_.motion().measured(motion_cost(besides_picture_ms_ + ms, passes));
    else if (started.step == PictureStep::in_motion && started.frame_ms > 0)
        pacing_.motion().measured(motion_cost(started.frame_ms, passes));
}

void Painter::note_picture(const Started& started, double ms) {
    FrameTimes& t = session_->times;
    const bool whole = started.step == PictureStep::whole;
    t.passes = started.made.passes;
    t.picture_ms = ms;
    t.visible = started.made.status.visible;
    t.intersections = started.made.status.intersections;
    if (!whole) return;
    t.full_ms = ms;
    pacing_.unsettle();
    if (session_->plan)
        session_->plan->note_frame(started.made.status.huge_splats,
                                   started.made.status.longest_list);
}

void Painter::take_psnr() {
    if (copies_.at == 0 || frame_ < copies_.at) return;
    session_->panes.psnr_db = panes_.psnr_db();
    copies_.at = 0;
    pacing_.unsettle();
}

// Runs after something that a picture needs has changed. Pipelines compile at their first use, and
// the first frames in motion are drawn at a quality that these rehearsals found.
void Painter::rehearse_motion(const PictureKey& key) {
    const bool first = rehearsals_ == kRehearsals;
    const FrameTimes& t = session_->times;
    if (first) besides_picture_ms_ = std::max(0.0, t.frame_ms - t.picture_ms);
    const MotionQuality quality = pacing_.motion().quality();
    // The first rehearsal makes the copy of the important splats, even where all are wanted now.
    const double splats = first ? std::min(quality.splats, picture_.most_moving()) : quality.splats;
    const std::vector<DisplaySettings> displays = shown_displays();
    Started started{
        .frame = frame_, .step = PictureStep::rehearsal, .quality = quality, .made = {}};
    started.counts = splats == quality.splats;
    started.pictures = displays.size();
    started.begun = Clock::now();
    session_->attempt([&] {
        for (std::size_t p = 0; p < displays.size(); ++p) {
            picture_.rehearse(frame_, at_scale(key.camera, quality.scale), displays[p], splats,
                              static_cast<int>(p));
            started.counts &= !picture_.compiled();
        }
        --rehearsals_;
        under_way_.push_back(std::move(started));
    });
}

void Painter::presented() {
    FrameTimes& t = session_->times;
    t.frame_ms = milliseconds_since(frame_start_);
    if (!under_way_.empty() && pacing_.in_motion()) {
        Started& started = under_way_.back();
        if (started.frame == frame_ && started.counts) {
            started.frame_ms = t.frame_ms;
            t.moving_ms.push_back(t.frame_ms);
            if (t.moving_ms.size() > kTimesKept) t.moving_ms.pop_front();
        }
    }
    take_results();  // some drivers, such as lavapipe, present only when all is done
}

std::optional<ImageU8> Painter::picture_alone(int width, int height, bool of_run) {
    if (!of_run) {
        // until step_work shows them again
        if (session_->edit.selected_count() > 0) show_marks(false);
        const WindowArea area = free_area(*session_, width, height);
        const Camera camera = camera_in_window(session_->photos, session_->navigation, area);
        const PaneWish wish = wish_for(camera, area, {});
        shows_panes_ = wish.several();
        panes_.render(picture_, wish);
        fit_panes();
        if (shows_panes_) panes_.compose(session_->panes);
    }
    const BufferPicture taken = of_run ? shown() : drawn();
    // the run has not drawn a picture yet
    if (taken.pixels == nullptr || taken.width == 0) return {};
    return read_pixels(*taken.pixels, taken.width, taken.height);
}

void Painter::start_export() {
    const PathState& p = session_->path;
    work_.start_export(
        p.path, {p.folder, p.fps, p.export_width, p.export_height, false, session_->display});
}

void Painter::start_measure(int width, int height) {
    const WindowArea area = free_area(*session_, width, height);
    work_.start_measure(camera_in_window(session_->photos, session_->navigation, area),
                        session_->display, session_->own);
}

void Painter::start_search(int least_views) {
    if (session_->photos.views.empty())
        throw Error("free space", "is what the cameras of photos look through, and there are none",
                    "Open it with its cameras: darb view SCENE --cameras DATASET.");
    std::vector<Camera> cameras;
    for (const View& view : session_->photos.views) cameras.push_back(view.camera);
    FreeSpaceOptions options;
    options.least_views = static_cast<std::uint32_t>(least_views);
    work_.start_search(*device_, session_->scene->shown(), cameras, options);
}

void Painter::step_search() {
    const std::optional<SplatSet> found = work_.step_search();
    if (found) show_edit(session_->edit.select(*found, Combine::replace), *session_);
}

void Painter::step_export(bool wait) {
    const std::optional<std::string> summary = work_.step_export(picture_, wait);
    if (!summary) return;
    session_->tell(*summary);
    pacing_.unsettle(PicturePacing::kSettlingFrames + 1);  // the panels report it
}

void Painter::step_work() {
    if (highlights_ == work_.draws() && session_->edit.selected_count() > 0)
        show_marks(!work_.draws());
    if (work_.draws()) {  // the picture then belongs to the work
        pacing_.forget();
        shows_panes_ = false;
    }
    if (work_.exports()) session_->attempt([&] { step_export(false); });
    if (work_.measures())
        session_->attempt([&] { session_->measured = work_.step_measure(picture_); });
    if (work_.searches()) session_->attempt([&] { step_search(); });
    if (work_.meshes()) session_->attempt([&] { take_mesh(false); });
    note_mesh();
    session_->progress.exporting = work_.export_share();
    session_->progress.measuring = work_.measure_share();
    session_->progress.searching = work_.search_share();
}

}  // namespace darb
