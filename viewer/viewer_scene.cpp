// What the viewer shows: a file that was loaded, or a training run; and how each is meant to be
// shown.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/raster/forward_options.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "viewer/controls.h"
#include "viewer/viewer.h"

namespace darb {

namespace {

namespace fs = std::filesystem;

bool any_lens(const std::vector<View>& views) {
    return std::any_of(views.begin(), views.end(),
                       [](const View& v) { return v.camera.lens.active; });
}

// Beside the scene, in its format where that is written; of a run in its output folder, where its
// cameras are.
fs::path edited_name(const fs::path& file) {
    const fs::path run = run_of_scene(file);
    if (!run.empty()) return run / (scene_name(file) + "_edited.ply");
    const std::string stem = stem_to_write(file),
                      ending = file.filename().string().substr(stem.size());
    const fs::path same = fs::path(file).replace_filename(stem + "_edited" + ending);
    if (!stem.empty() && format_to_write(same)) return same;
    return fs::path(file).replace_filename(file.stem().string() + "_edited.ply");
}

}  // namespace

void Viewer::open(const std::filesystem::path& path) {
    start_load(path, false);
}

void Viewer::open_file(const std::filesystem::path& file, bool merges) {
    if (!merges) return drop(file);
    need_scene("merging");
    start_load(file, true, true);
}

void Viewer::merge(LoadedScene loaded) {
    Session& s = session_;
    const std::string from = loaded.scene.file.filename().string();
    if (s.edit.transforms()) choose_tool(Tool::navigate, s);
    const Bounds added = loaded.scene.subject;
    const std::size_t count = s.edit.merge(std::move(loaded.scene.model), s.scene->model);
    try {
        show_edits();
    } catch (const std::exception&) {  // the device has no room: as it was before
        s.edit.take_back(s.scene->model);
        show_edits();
        throw;
    }
    if (count > 0) s.ask(request::Frame{added.centre, added.radius});
    s.tell(
        fmt::format("merged {} splats of {}: they are selected, and 6, 7 and 8 move, turn and "
                    "scale them",
                    count, from));
}

// What a user drops: not on a run, and not over unsaved edits without a question.
void Viewer::drop(const std::filesystem::path& path) {
    Session& s = session_;
    if (s.training.live && !s.training.finished)
        s.tell("A run is shown: files can be opened when it is over.");
    else if (s.scene && s.edit.unsaved())
        s.leaving = Leaving{false, path};
    else
        start_load(path, true);
}

void Viewer::start_load(const std::filesystem::path& path, bool dropped, bool merges) {
    attempt([&] {
        loader_.start(path, dropped, merges, dropped ? StoredUnits{} : options_.units);
        edit_at_load_ = session_.edit.content();
        session_.error.clear();
        if (dropped) session_.note.clear();
    });
}

void Viewer::finish_loading() {
    if (!loading()) {
        if (!session_.error.empty()) throw Error("darb view", session_.error);
        return;
    }
    if (std::optional<LoadedScene> loaded = loader_.wait()) show(std::move(*loaded));
}

void Viewer::take_loaded() {
    attempt([&] {
        if (std::optional<LoadedScene> loaded = loader_.poll()) {
            const Edit& edit = session_.edit;
            if (loaded->merges && session_.scene)
                merge(std::move(*loaded));
            else if (session_.scene && edit.unsaved() && edit.content() != edit_at_load_)
                session_.leaving = Leaving{false, loaded->asked_for};  // edited since
            else
                show(std::move(*loaded));
        }
    });
    session_.progress.load = loader_.share();
    session_.progress.load_stage = loader_.stage();
}

// The device's copy first: when that fails, the scene before is still there.
void Viewer::show(LoadedScene loaded) {
    auto scene = std::make_unique<Scene>(std::move(loaded.scene));
    picture_.set_scene(scene->model, scene->bounds, std::move(scene->important));
    warm_up_.reset();
    lose_scene("another scene was opened");
    shares_ = picture_.most_moving() < 1
                  ? motion_shares(picture_.splat_count(), picture_.most_moving())
                  : std::vector<double>();
    pacing_.motion().start(shares_);
    // The scene of a run that was shown: from where the user looked at the run.
    const bool of_run = session_.scene == nullptr && session_.training.finished;
    const bool first = session_.scene == nullptr && !of_run;
    session_.leaving.reset();
    if (loaded.dropped) find_own_cameras(loaded.asked_for, scene->notes);
    find_subject(*scene);
    session_.scene = std::move(scene);
    const std::filesystem::path& asked = loaded.asked_for;
    session_.title = scene_name(asked, true) + " - darb";
    const Scene& s = *session_.scene;
    session_.sh_degree = s.model.sh_degree;
    session_.edit = Edit(s.model.size());
    session_.tools = {};
    session_.tools.grow = static_cast<float>(s.subject.radius / 50);
    session_.tools.scale[1] = static_cast<float>(s.subject.radius / 10);
    shown_model_ = shown_edit_ = 0;
    try {
        recent_.opened(asked);
    } catch (const std::exception& e) {  // the scene is there all the same
        session_.scene->notes.emplace_back(e.what());
    }
    session_.selection.region = {Region::Shape::box, s.subject.centre,
                                 glm::dvec3(s.subject.radius)};
    session_.save_file = edited_name(s.file);
    session_.fly_speed = s.subject.radius / 2;
    show_as_meant(s, first);
    tell(options_.quiet ? nullptr : stdout, "loaded {}: {} splats in {:.2f} s\neffects: {}\n",
         s.file.string(), s.model.size(), s.load_s, plan_line(*session_.plan));
    for (const std::string& note : s.is_points ? std::vector<std::string>{} : s.notes)
        say("warning: {}: {}\n", s.file.string(), note);
    if (first) session_.navigation.level();
    first_look(of_run);
    set_pivot();
    if (of_run && options_.second_device && live_size_.x > 0)
        start_warm_up();
    else
        live_size_ = {0, 0};
}

// Until it is over the run's last picture stays, and the window lives.
void Viewer::start_warm_up() {
    constexpr int kSize = 256;  // px
    warm_up_ = std::make_unique<WarmUp>(*device_, *options_.second_device, session_.scene->model,
                                        shown_displays(), session_.navigation.camera(kSize, kSize),
                                        options_.wake);
}

void Viewer::end_warm_up() {
    warm_pipelines_ = warm_up_->take_pipelines();
    warm_up_.reset();
    live_size_ = {0, 0};
    pacing_.forget();
}

// Through a camera of the data set where there are some; else from outside, upright.
void Viewer::first_look(bool of_run) {
    const Scene& s = *session_.scene;
    Photos& p = session_.photos;
    session_.up_is_guess = false;
    if (!of_run && p.current < 0 && p.views.empty() && options_.up.empty()) {
        const std::optional<glm::dvec3> up = remembered_.find(s.file);
        session_.up_is_guess = !up && s.up.empty();
        session_.navigation.set_up(up             ? *up
                                   : s.up.empty() ? guess_up(s.model)
                                                  : up_from_name(s.up));
    }
    known_up_ = session_.navigation.up;
    if (of_run || p.current >= 0) return;
    if (options_.start_at_camera && !p.views.empty()) {
        choose_camera(0);
        p.compare = fs::is_regular_file(p.view().photo);
    } else {
        session_.ask(request::FrameAll{});
    }
}

// Where cameras or the command line say what is up, nothing is to be remembered.
void Viewer::remember_up() {
    const glm::dvec3 up = session_.navigation.up;
    if (!session_.scene || up == known_up_) return;
    known_up_ = up;
    session_.up_is_guess = false;
    if (session_.photos.views.empty()) attempt([&] { remembered_.keep(session_.scene->file, up); });
}

// The frames of an export, and the pictures of a measurement, are of one scene.
void Viewer::lose_scene(const char* why) {
    const std::string note = work_.lose_scene(why);
    if (!note.empty()) session_.tell(note);
    lose_levels();
    ++version_;
}

// What was merged into it belongs to it, wherever it is.
void Viewer::find_subject(Scene& scene) const {
    const std::vector<std::size_t> parts = session_.edit.parts();
    const bool merged = session_.scene.get() == &scene && parts.size() > 1;
    const auto part = [&](std::size_t n) {
        std::vector<std::uint32_t> splats(parts[n]);
        const auto begin = std::accumulate(parts.begin(), parts.begin() + std::ptrdiff_t(n), 0u);
        std::iota(splats.begin(), splats.end(), static_cast<std::uint32_t>(begin));
        return pick_splats(scene.model, splats);
    };
    const std::vector<Camera> cameras = cameras_of(session_.photos.views);
    if (!cameras.empty())
        scene.subject = subject_of(scene.model, cameras);
    else if (merged)
        scene.subject = subject_of(part(0));
    for (std::size_t n = 1; merged && n < parts.size(); ++n)
        static_cast<Bounds&>(scene.subject) = enclosing(scene.subject, dense_bounds(part(n)));
}

Subject Viewer::shown_subject() const {
    if (live_ == nullptr && session_.scene) return session_.scene->subject;
    return {live_bounds_};
}

// As far as what is looked at: orbits turn around it, pans follow the hand.
void Viewer::set_pivot() {
    constexpr int kSize = 1000;  // px
    static const SplatModel kNone;
    Navigation& n = session_.navigation;
    const Photos& p = session_.photos;
    const SplatModel& model = live_ == nullptr && session_.scene ? session_.scene->model : kNone;
    n.distance = pivot_depth(shown_subject(), model,
                             p.current >= 0 ? p.view().camera : n.camera(kSize, kSize));
}

// So that the picture does not jump where the free camera takes over from the photo's.
void Viewer::follow_photo(int width, int height) {
    Photos& p = session_.photos;
    if (p.current < 0) return;
    const Camera camera =
        camera_in_window(p, session_.navigation, free_area(session_, width, height));
    p.shown_fov_y = 2 * std::atan(0.5 * height / camera.fy);
    p.shown_centre_x = draws_every_centre(session_.display.effects) ? camera.cx / width : 0.5;
}

// Cameras belong to the scene that they were opened with.
void Viewer::find_own_cameras(const std::filesystem::path& scene, std::vector<std::string>& notes) {
    if (!options_.find_cameras) return;
    leave_photo(session_);
    session_.photos = Photos();
    try {
        session_.photos.views = options_.find_cameras(scene);
    } catch (const std::exception& e) {
        notes.emplace_back(e.what());
    }
}

// As the file says, but for what the command line wants otherwise.
void Viewer::show_as_meant(const Scene& s, bool first) {
    DisplaySettings& d = session_.display;
    d.kernel = s.model.kernel;
    d.footprint = s.model.footprint;
    d.sh_degree = s.model.sh_degree;
    d.effects = {};
    d.effects.antialias = s.model.antialias;
    d.effects.lens = any_lens(session_.photos.views);
    d.huge_splat_path = HugeSplatPath::by_counters;
    d.near_plane = near_plane_for(s.bounds);
    session_.own = d;
    session_.measured.clear();
    session_.plan = plan_rendering(
        s.model, session_.photos.views,
        {.depth = d.mode == VIEW_DEPTH, .near_plane = d.near_plane, .free_camera = true},
        options_.effects);
    follow_plan();
    const FrameAccuracy wanted = frame_accuracy(options_.accuracy, s.model);
    d.footprint = wanted.footprint;
    d.sh_degree = std::min(d.sh_degree, wanted.sh_degree);
    const bool depth = session_.plan->on(EFFECT_DEPTH);
    if (first && depth != (d.mode == VIEW_DEPTH)) d.mode = depth ? VIEW_DEPTH : VIEW_COLOUR;
}

void Viewer::follow_plan() {
    if (!session_.plan) return;
    const EffectPlan& plan = *session_.plan;
    DisplaySettings& d = session_.display;
    d.effects = plan.projection();
    d.huge_splat_path = plan.huge_splat_path();
    d.sh_degree = plan.row(EFFECT_VIEW_COLOUR).degree;
}

void Viewer::show_live(LivePicture& pictures, const Bounds& bounds, const LiveScene& scene) {
    live_ = &pictures;
    live_bounds_ = bounds;
    session_.training.live = true;
    shares_.clear();
    pacing_.motion().start({});
    show_as_trained(scene, true);
    session_.fly_speed = bounds.radius / 2;
    if (session_.photos.current < 0) session_.ask(request::FrameAll{});
    set_pivot();
}

// Whoever sees every degree there is goes on to.
void Viewer::show_degree(int degree) {
    DisplaySettings& d = session_.display;
    if (d.sh_degree == session_.sh_degree) d.sh_degree = degree;
    session_.sh_degree = session_.own.sh_degree = degree;
}

void Viewer::show_as_trained(const LiveScene& scene, bool first) {
    live_scene_ = scene;
    DisplaySettings& d = session_.display;
    if (first) d.sh_degree = session_.sh_degree;
    show_degree(scene.sh_degree);  // it grows
    d.effects.smoothing = session_.own.effects.smoothing = scene.antialias && scene.smoothing;
    if (!first) return;
    d.kernel = scene.kernel;
    d.footprint = scene.footprint;
    d.effects.antialias = scene.antialias;
    d.effects.lens = any_lens(session_.photos.views);
    session_.own = d;
}

// The run draws what is wished for when it comes to it; until then its last picture is there.
void Viewer::follow_live(int width, int height) {
    Session& s = session_;
    attempt([&] {
        while (const std::optional<LiveMade> made = live_->take()) take_live(*made);
    });
    const WindowArea area = free_area(s, width, height);
    const std::vector<int> beside = kernels_beside(s.panes, s.display.kernel);
    const std::size_t panes = beside.size() + (photo_beside(s.photos, s.display) ? 2 : 1);
    fit_lines(panes, s.panes, compared_strip(s.photos, s.display, area));
    live_->wish({{camera_in_window(s.photos, s.navigation, area), s.display, s.photos.current,
                  s.photos.compare, beside, 0},
                 area,
                 s.panes});
}

void Viewer::take_live(const LiveMade& made) {
    if (!(made.scene == live_scene_)) show_as_trained(made.scene, false);
    if (!made.error.empty()) {
        session_.error = made.error;
        session_.photos.compare = false;
        if (session_.display.mode == VIEW_ERROR) session_.display.mode = VIEW_COLOUR;
    }
    session_.photos.loaded = made.photo;
    if (made.pixels.empty()) return;
    if (live_pixels_.bytes() < made.pixels.size() * 4)
        live_pixels_ = Buffer(*device_, "live picture", made.pixels.size() * 4);
    live_pixels_.upload(made.pixels);
    live_size_ = {made.width, made.height};
    session_.panes.psnr_db = made.psnr_db;
    FrameTimes& t = session_.times;
    t.passes = made.passes;
    t.picture_ms = made.ms;
    t.quality = made.quality;
    if (made.whole) t.full_ms = made.ms;
    t.visible = made.visible;
    t.intersections = made.intersections;
}

void Viewer::end_live() {
    if (live_ != nullptr)
        attempt([&] {
            while (const std::optional<LiveMade> made = live_->take()) take_live(*made);
        });
    live_ = nullptr;
    session_.photos.loaded = -1;  // on another device
    session_.training.finished = true;
}

}  // namespace darb
