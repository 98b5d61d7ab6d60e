// SPDX-License-Identifier: MIT
// What is shown is a file that was loaded or a training run. The document knows how each is meant
// to be shown, and what of it has been written to files.
#include "viewer/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string_view>
#include <utility>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/mesh/mesh_file.h"
#include "engine/publish/device_clusters.h"
#include "engine/publish/web_page.h"
#include "engine/raster/forward_options.h"
#include "engine/scene/edit_script.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/subject.h"
#include "viewer/controls.h"

namespace darb {

namespace {

namespace fs = std::filesystem;

constexpr double kFilled = 0.94;  // share of the free area that a framed scene fills

bool any_lens(const std::vector<View>& views) {
    return std::any_of(views.begin(), views.end(),
                       [](const View& v) { return v.camera.lens.active; });
}

// Pictures of a window have all rows of one moment.
std::vector<View> without_shutters(std::vector<View> views) {
    for (View& view : views) view.camera.shutter = {};
    return views;
}

// Edits are saved beside the scene, in its format where that can be written. Those of a run go into
// its output folder, where its cameras are.
fs::path edited_name(const fs::path& file) {
    if (is_project_file(file)) {
        constexpr std::size_t kEnding = std::string_view(".darb.json").size();
        const std::string name = file.filename().string();
        return fs::path(file).replace_filename(name.substr(0, name.size() - kEnding) +
                                               "_edited.ply");
    }
    const fs::path run = run_of_scene(file);
    if (!run.empty()) return run / (scene_name(file) + "_edited.ply");
    const std::string stem = stem_to_write(file),
                      ending = file.filename().string().substr(stem.size());
    const fs::path same = fs::path(file).replace_filename(stem + "_edited" + ending);
    if (!stem.empty() && format_to_write(same)) return same;
    return fs::path(file).replace_filename(file.stem().string() + "_edited.ply");
}

glm::dvec3 start_up(const ViewerOptions& options) {
    if (!options.up.empty()) return up_from_name(options.up);
    return up_of_cameras(cameras_of(options.views)).value_or(glm::dvec3(0, -1, 0));
}

}  // namespace

Document::Document(Session& session, ViewerOptions options)
    : session_(&session),
      options_(std::move(options)),
      loader_(options_.resolve, options_.wake),
      remembered_(options_.up_list),
      recent_(options_.recent_list) {
    for (const fs::path& path : options_.more) to_add_.push_back({path, false});
    session.photos.views = without_shutters(options_.views);
    session.navigation.set_up(start_up(options_));
    session.display.accuracy = options_.accuracy;
    // These apply to each scene that is opened; see show_as_meant.
    session.display.accuracy.choice[kFootprint] = session.display.accuracy.choice[kShDegree] = 0;
}

void Document::load(const fs::path& path, bool dropped, bool merges) {
    if (dropped && !merges) to_add_.clear();
    loader_.start(path, dropped, merges, dropped ? StoredUnits{} : options_.units);
    edit_at_load_ = session_->edit.content();
    session_->error.clear();
    if (dropped) session_->note.clear();
}

void Document::load_next() {
    if (loading() || to_add_.empty() || !session_->scene) return;
    const ToAdd next = to_add_.front();
    to_add_.pop_front();
    load(next.path, next.dropped, true);
}

void Document::cancel_load() {
    to_add_.clear();
    loader_.cancel();
    session_->progress.load = -1;
}

std::optional<LoadedScene> Document::take_loaded(bool wait) {
    const auto report = [&] {
        session_->progress.load = loader_.share();
        session_->progress.load_stage = loader_.stage();
    };
    try {
        std::optional<LoadedScene> loaded = wait ? loader_.wait() : loader_.poll();
        report();
        return loaded;
    } catch (...) {
        report();
        throw;
    }
}

bool Document::edited_meanwhile() const {
    const Edit& edit = session_->edit;
    return session_->scene && edit.unsaved() && edit.content() != edit_at_load_;
}

bool Document::show(std::unique_ptr<Scene> scene, const fs::path& asked, bool dropped) {
    // The scene of a run that was shown is seen from where the user looked at the run.
    const bool of_run = session_->scene == nullptr && session_->training.finished;
    const bool first = session_->scene == nullptr && !of_run;
    session_->leaving.reset();
    if (dropped) find_own_cameras(asked, scene->notes);
    find_subject(*scene);
    session_->scene = std::move(scene);
    session_->title = scene_name(asked, true) + " - darb";
    const Scene& s = *session_->scene;
    session_->sh_degree = s.model.sh_degree;
    begin_edits(*session_->scene, asked);
    session_->tools = {};
    session_->tools.grow = static_cast<float>(s.subject.radius / 50);
    session_->tools.scale[1] = static_cast<float>(s.subject.radius / 10);
    measured_model_ = 0;
    try {
        recent_.opened(asked);
    } catch (const std::exception& e) {  // the scene is shown all the same
        session_->scene->notes.emplace_back(e.what());
    }
    session_->selection.region = {Region::Shape::box, s.subject.centre,
                                  glm::dvec3(s.subject.radius)};
    session_->save_file = edited_name(s.file);
    session_->project.to_save =
        s.project
            ? s.file
            : fs::path(session_->save_file).replace_filename(scene_name(s.file) + ".darb.json");
    session_->mesh_file = session_->save_file.parent_path() / (scene_name(s.file) + "_mesh.glb");
    session_->mesh_wish = {};
    session_->fly_speed = s.subject.radius / 2;
    show_as_meant(s, first);
    const std::string what =
        s.mesh ? s.format : fmt::format("{} splats", count_text(s.model.size()));
    tell(options_.quiet ? nullptr : stdout, "loaded {}: {} in {:.2f} s\neffects: {}\n",
         s.file.string(), what, s.load_s, plan_line(*session_->plan));
    for (const std::string& note : s.is_points ? std::vector<std::string>{} : s.notes)
        say("warning: {}: {}\n", s.file.string(), note);
    if (first) session_->navigation.level();
    first_look(of_run);
    set_pivot();
    if (s.project && take_project(s.project->project, *session_))
        take_back<request::FrameAll>(session_->requests);
    session_->scene->project.reset();
    return of_run;
}

void Document::begin_edits(Scene& scene, const fs::path& asked) {
    Session& s = *session_;
    s.project = {};
    s.outliner = {};
    s.note_draft = {};
    s.project.first_file = scene.file;
    s.project.first_name = scene_name(asked);
    s.edit = Edit(scene.model, s.project.first_name, scene.file);
    drawn_model_ = 0;
    s.project.cameras = std::exchange(options_.cameras, {});
    if (!scene.project) return;
    const ProjectLayer& layer = scene.project->project.layers.front();
    s.edit = std::move(scene.project->edit);
    s.edit.mark_saved();
    drawn_model_ = s.edit.model_version();
    s.project.file = scene.file;
    s.project.first_file = layer.file;
    s.project.first_name = layer.name.empty() ? scene_name(layer.file) : layer.name;
}

std::size_t Document::merge(SplatModel added, const edits::Add& source) {
    Session& s = *session_;
    if (s.edit.transforms()) choose_tool(Tool::navigate, s);
    return s.edit.merge(std::move(added), s.scene->model, source);
}

void Document::follow_edits() {
    Session& s = *session_;
    draw_as_edited();
    if (s.edit.transforms() || s.edit.model_version() == measured_model_) return;
    measure_scene(*s.scene);
    find_subject(*s.scene);
    show_degree(s.scene->model.sh_degree);
    measured_model_ = s.edit.model_version();
}

// Layers of different kernels are drawn as Gaussians, and as they are again where only one kernel
// is left.
void Document::draw_as_edited() {
    Session& s = *session_;
    if (s.edit.model_version() == drawn_model_) return;
    drawn_model_ = s.edit.model_version();
    Scene& scene = *s.scene;
    const LayerLook before = look_of(scene.shown());
    scene.drawn = s.edit.drawn_otherwise(scene.model);
    const LayerLook now = look_of(scene.shown());
    if (now == LayerLook{s.own.kernel, s.own.footprint, s.own.effects.antialias} && now == before)
        return;
    for (DisplaySettings* d : {&s.display, &s.own}) {
        d->kernel = now.kernel;
        d->footprint = now.footprint;
        d->effects.antialias = now.antialias;
    }
}

// Looks through a camera of the data set where there is one, otherwise from outside and upright.
void Document::first_look(bool of_run) {
    const Scene& s = *session_->scene;
    Photos& p = session_->photos;
    session_->up_is_guess = false;
    if (!of_run && p.current < 0 && p.views.empty() && options_.up.empty()) {
        const std::optional<glm::dvec3> up = remembered_.find(s.file);
        session_->up_is_guess = !up && s.up.empty();
        session_->navigation.set_up(up             ? *up
                                    : s.up.empty() ? guess_up(s.model)
                                                   : up_from_name(s.up));
    }
    known_up_ = session_->navigation.up;
    if (of_run || p.current >= 0) return;
    if (options_.start_at_camera && !p.views.empty()) {
        choose_camera(0);
        p.compare = fs::is_regular_file(p.view().photo);
    } else {
        session_->ask(request::FrameAll{});
    }
}

// Nothing needs to be remembered where cameras or the command line say what is up.
void Document::remember_up() {
    const glm::dvec3 up = session_->navigation.up;
    if (!session_->scene || up == known_up_) return;
    known_up_ = up;
    session_->up_is_guess = false;
    if (session_->photos.views.empty()) remembered_.keep(session_->scene->file, up);
}

// Scenes that were merged into this one count as a part of it, wherever they are.
void Document::find_subject(Scene& scene) const {
    const std::vector<std::size_t> parts = session_->edit.parts();
    const bool merged = session_->scene.get() == &scene && parts.size() > 1;
    const auto part = [&](std::size_t n) {
        std::vector<std::uint32_t> splats(parts[n]);
        const auto begin = std::accumulate(parts.begin(), parts.begin() + std::ptrdiff_t(n), 0u);
        std::iota(splats.begin(), splats.end(), static_cast<std::uint32_t>(begin));
        return pick_splats(scene.model, splats);
    };
    const std::vector<Camera> cameras = cameras_of(session_->photos.views);
    if (!cameras.empty())
        scene.subject = subject_of(scene.model, cameras);
    else if (merged)
        scene.subject = subject_of(part(0));
    for (std::size_t n = 1; merged && n < parts.size(); ++n)
        static_cast<Bounds&>(scene.subject) = enclosing(scene.subject, dense_bounds(part(n)));
}

Subject Document::shown_subject() const {
    if (live_ == nullptr && session_->scene) return session_->scene->subject;
    return {live_bounds_};
}

// Puts the pivot at the depth of what is looked at: orbits turn around it, and pans follow the
// hand.
void Document::set_pivot() {
    constexpr int kSize = 1000;  // px
    static const SplatModel kNone;
    Navigation& n = session_->navigation;
    const Photos& p = session_->photos;
    const SplatModel& model = live_ == nullptr && session_->scene ? session_->scene->model : kNone;
    n.distance = pivot_depth(shown_subject(), model,
                             p.current >= 0 ? p.view().camera : n.camera(kSize, kSize));
}

// The picture must not jump where the free camera takes over from the photo's.
void Document::follow_photo(int width, int height) {
    Photos& p = session_->photos;
    if (p.current < 0) return;
    const Camera camera =
        camera_in_window(p, session_->navigation, free_area(*session_, width, height));
    p.shown_fov_y = 2 * std::atan(0.5 * height / camera.fy);
    const bool any_centre = draws_every_centre(session_->display.effects);
    p.shown_centre_x = any_centre ? camera.cx / width : 0.5;
    p.shown_centre_y = any_centre ? camera.cy / height : 0.5;
}

void Document::choose_camera(int n) {
    const int count = static_cast<int>(session_->photos.views.size());
    if (n < 0 || n >= count)
        throw Error("--camera",
                    count == 0 ? "there is no data set to take a camera from"
                               : fmt::format("{} is not one of 0 to {}", n, count - 1),
                    "Name the data set, or a cameras.json: --cameras DATASET.");
    session_->photos.current = n;
    session_->photos.failed = false;
    take_back<request::FrameAll>(session_->requests);  // requests for an earlier scene
    session_->navigation.take(session_->photos.view().camera);
    if (!empty()) set_pivot();
}

void Document::need_scene(const char* what) const {
    if (follows_run())
        throw Error(what, "a run is shown", "Wait for its end, when its scene is opened.");
    if (!session_->scene)
        throw Error(what, "there is no scene",
                    "Open one: name it on the command line, or drop it on the window.");
}

void Document::frame_on(const Bounds& bounds, int width, int height) {
    leave_photo(*session_);
    Navigation& n = session_->navigation;
    const WindowArea area = free_area(*session_, width, height);
    const bool beside = draws_every_centre(session_->display.effects);
    n.centre_x = beside ? (area.left + area.free_width() / 2.0) / width : 0.5;
    n.centre_y = beside ? (area.top + area.free_height() / 2.0) / height : 0.5;
    const double wide = beside ? area.free_width() : width;
    const double high = beside ? area.free_height() : height;
    const double tan_y = std::tan(n.fov_y / 2) * high / height, tan_x = tan_y * wide / high;
    const double distance = session_->scene
                                ? framing_distance(session_->scene->model, bounds, n.axes,
                                                   kFilled * tan_x, kFilled * tan_y)
                                : 0;
    if (distance > 0)
        n.look_from(bounds.centre, distance);
    else
        n.frame(bounds.centre, bounds.radius, wide / high);
}

// Cameras belong to the scene with which they were opened.
void Document::find_own_cameras(const std::filesystem::path& scene,
                                std::vector<std::string>& notes) {
    if (!options_.find_cameras) return;
    leave_photo(*session_);
    session_->photos = Photos();
    session_->thumbnails.reset();
    try {
        session_->photos.views = without_shutters(options_.find_cameras(scene));
    } catch (const std::exception& e) {
        notes.emplace_back(e.what());
    }
}

// Shows the scene as its file says, except where the command line asks for something else.
void Document::show_as_meant(const Scene& s, bool first) {
    DisplaySettings& d = session_->display;
    d.kernel = s.shown().kernel;
    d.footprint = s.shown().footprint;
    d.sh_degree = s.model.sh_degree;
    d.effects = {};
    d.effects.antialias = s.model.antialias;
    d.effects.lens = any_lens(session_->photos.views);
    d.huge_splat_path = HugeSplatPath::by_counters;
    d.near_plane = near_plane_for(s.bounds);
    session_->own = d;
    session_->measured.clear();
    session_->plan = plan_rendering(
        s.shown(), session_->photos.views,
        {.depth = d.mode == VIEW_DEPTH, .near_plane = d.near_plane, .free_camera = true},
        options_.effects);
    follow_plan();
    const FrameAccuracy wanted = frame_accuracy(options_.accuracy, s.shown());
    d.footprint = wanted.footprint;
    d.sh_degree = std::min(d.sh_degree, wanted.sh_degree);
    const bool depth = session_->plan->on(EFFECT_DEPTH);
    if (first && depth != (d.mode == VIEW_DEPTH)) d.mode = depth ? VIEW_DEPTH : VIEW_COLOUR;
}

void Document::follow_plan() {
    if (!session_->plan) return;
    const EffectPlan& plan = *session_->plan;
    DisplaySettings& d = session_->display;
    d.effects = plan.projection();
    d.huge_splat_path = plan.huge_splat_path();
    d.sh_degree = plan.row(EFFECT_VIEW_COLOUR).degree;
}

void Document::make_room_for_run(std::vector<View> views) {
    Session& s = *session_;
    cancel_load();
    s.scene.reset();
    s.edit = Edit();
    s.tools = {};
    s.outliner = {};
    s.project = {};
    s.note_draft = {};
    s.selection.shown = false;
    s.measured.clear();
    s.plan.reset();
    s.leaving.reset();
    s.up_is_guess = false;
    s.training = {};
    s.run_desk = {};
    drawn_model_ = measured_model_ = 0;
    s.photos = Photos();
    s.thumbnails.reset();
    s.guides.cameras_measured = 0;
    s.photos.views = without_shutters(std::move(views));
    if (const auto up = up_of_cameras(cameras_of(s.photos.views))) s.navigation.set_up(*up);
    if (!s.photos.views.empty()) choose_camera(0);
}

void Document::follow_run(LivePicture& pictures, const Bounds& bounds, const LiveScene& scene) {
    live_ = &pictures;
    live_bounds_ = session_->run_bounds = bounds;
    session_->training.live = true;
    show_as_trained(scene, true);
    session_->fly_speed = bounds.radius / 2;
    if (session_->photos.current < 0) session_->ask(request::FrameAll{});
    set_pivot();
}

// A user who sees every degree goes on to see every degree.
void Document::show_degree(int degree) {
    DisplaySettings& d = session_->display;
    if (d.sh_degree == session_->sh_degree) d.sh_degree = degree;
    session_->sh_degree = session_->own.sh_degree = degree;
}

void Document::show_as_trained(const LiveScene& scene, bool first) {
    live_scene_ = scene;
    DisplaySettings& d = session_->display;
    if (first) d.sh_degree = session_->sh_degree;
    show_degree(scene.sh_degree);  // a run's degree grows
    d.effects.smoothing = session_->own.effects.smoothing = scene.antialias && scene.smoothing;
    if (!first) return;
    d.kernel = scene.kernel;
    d.footprint = scene.footprint;
    d.effects.antialias = scene.antialias;
    d.effects.lens = any_lens(session_->photos.views);
    session_->own = d;
}

std::optional<LiveMade> Document::take_picture_of_run() {
    if (live_ == nullptr) return {};
    std::optional<LiveMade> made = live_->take();
    if (!made) return {};
    if (!(made->scene == live_scene_)) show_as_trained(made->scene, false);
    if (!made->error.empty()) {
        session_->error = made->error;
        session_->photos.compare = false;
        if (session_->display.mode == VIEW_ERROR) session_->display.mode = VIEW_COLOUR;
    }
    session_->photos.loaded = made->photo;
    return made;
}

// The run draws the wish when it gets to it; until then its last picture stays.
void Document::wish(int width, int height) {
    if (live_ == nullptr) return;
    Session& s = *session_;
    const WindowArea area = free_area(s, width, height);
    const std::vector<int> beside = kernels_beside(s.panes, s.display.kernel);
    const std::size_t panes = beside.size() + (photo_beside(s.photos, s.display) ? 2 : 1);
    fit_lines(panes, s.panes, compared_strip(s.photos, s.display, area));
    live_->wish({{camera_in_window(s.photos, s.navigation, area), s.display, s.photos.current,
                  s.photos.compare, beside, 0},
                 area,
                 s.panes});
}

void Document::end_run() {
    live_ = nullptr;
    session_->photos.loaded = -1;  // the photo is loaded on another device
    session_->training.finished = true;
}

void Document::load_path() {
    PathState& p = session_->path;
    p.path = read_camera_path(p.file);
    p.mark_saved();
    session_->tell(fmt::format("{} key frames from {}", p.path.keys.size(), p.file.string()));
}

void Document::save_path() {
    PathState& p = session_->path;
    saved_.check(p.file);
    write_camera_path(p.file, p.path);
    saved_.wrote(p.file);
    p.mark_saved();
    session_->tell("path in " + p.file.string());
}

void Document::save(Device& device) {
    if (!session_->scene) return;
    if (keeps_project(*session_))
        save_project();
    else
        save_scene(device);
}

void Document::save_project() {
    Session& s = *session_;
    fs::path& file = s.project.to_save;
    if (!is_project_file(file))
        throw Error(file.string(), "is not the name of a project",
                    "Let it end in .darb.json. Section Edit saves one file of splats.");
    saved_.check(file);
    write_project(file, project_of_session(s));
    saved_.wrote(file);
    s.project.file = file;
    s.edit.mark_saved();
    s.path.mark_saved();
    s.tell(fmt::format("saved the project of {} to {}", counted(s.edit.layers().size(), "layer"),
                       file.string()));
}

void Document::save_script() {
    Session& s = *session_;
    if (!s.scene) return;
    const fs::path file =
        fs::path(s.save_file).replace_filename(stem_to_write(s.save_file) + ".edits.json");
    saved_.check(file);
    const std::vector<EditOperation> operations = s.edit.operations();
    write_edit_script(file, operations);
    saved_.wrote(file);
    s.tell(fmt::format("saved {} to {}", counted(operations.size(), "edit"), file.string()));
}

namespace {

// A name of a layer may have letters that a file name cannot have.
fs::path file_of_layer(const fs::path& file, const std::string& layer) {
    const std::string stem = stem_to_write(file), whole = file.filename().string();
    std::string name = layer;
    for (char& c : name)
        if (std::string_view("/\\:*?\"<>|").find(c) != std::string_view::npos ||
            static_cast<unsigned char>(c) < ' ')
            c = '_';
    return fs::path(file).replace_filename(stem + "_" + name + whole.substr(stem.size()));
}

}  // namespace

void Document::save_scene(Device& device, const std::string& layer) {
    Session& s = *session_;
    if (!s.scene) return;
    const fs::path file = layer.empty() ? s.save_file : file_of_layer(s.save_file, layer);
    const std::optional<SplatFormat> format = format_to_write(file);
    if (!format)
        throw Error(file.string(), "its ending names no format to write",
                    "Use " + endings_to_write() + ".");
    saved_.check(file);
    SplatModel model =
        layer.empty() ? s.edit.apply(s.scene->model)
                      : s.edit.apply(s.scene->model, s.edit.layers()[s.edit.layer_named(layer)]);
    if (s.save_upright || s.edit.facts().ground)
        transform_splats({.turn = turn_to_up(s.navigation.up)}, model);
    DeviceClusters clusters(device);
    EncodeOptions options;
    options.assign_rows = clusters.assign_rows();
    write_encoded(file, encode_scene(*format, model, file.string(), options));
    saved_.wrote(file);
    if (!keeps_project(s)) s.edit.mark_saved();
    std::string said =
        fmt::format("saved {} splats to {}", count_text(model.size()), file.string());
    if (layer.empty())
        for (const std::string& loss : s.edit.losses_together()) said += "\n" + loss;
    for (const std::string& loss : losses_of(*format, model)) said += "\n" + loss;
    s.tell(said);
}

void Document::save_mesh() {
    Session& s = *session_;
    if (!s.mesh)
        throw Error("mesh", "there is none to save", "Make one, or open one, in the tab Mesh.");
    saved_.check(s.mesh_file);
    write_mesh(s.mesh_file, s.mesh->mesh);
    saved_.wrote(s.mesh_file);
    s.mesh->file = s.mesh_file;
    s.tell(fmt::format("saved a mesh of {} faces to {}", count_text(s.mesh->mesh.face_count()),
                       s.mesh_file.string()));
}

// The page opens at the window's view, and the cameras of the photos follow.
void Document::save_page(Device& device, int width, int height) {
    Session& s = *session_;
    if (!s.scene) return;
    fs::path file = s.save_file;
    file.replace_extension(".html");
    saved_.check(file);
    WebPageOptions options;
    options.title = scene_name(s.scene->file);
    options.background = s.display.background;
    options.views = s.photos.views;
    View shown;
    shown.name = "As it was saved";
    // The page shows what is seen beside the panel, as it has none.
    const WindowArea area = free_area(s, width, height);
    Navigation centred = s.navigation;
    centred.centre_x = centred.centre_y = 0.5;
    shown.camera = camera_in_window(s.photos, centred, {area.free_width(), height});
    options.up = s.navigation.up;
    options.views.insert(options.views.begin(), shown);
    WebPageFacts facts;
    write_file_atomic(file, make_web_page(device, s.edit.apply(s.scene->model), options, &facts));
    saved_.wrote(file);
    s.tell(fmt::format("web page in {}\n{}", file.string(), web_page_text(facts)));
}

}  // namespace darb
