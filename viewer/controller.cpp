// SPDX-License-Identifier: MIT
#include "viewer/controller.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/data/image_io.h"
#include "engine/scene/splat_file.h"
#include "viewer/tools.h"

namespace darb {

namespace {

namespace fs = std::filesystem;

// A name is not free if a link has it, wherever the link leads.
fs::path free_picture_name() {
    for (int n = 1;; ++n) {
        const fs::path file = fmt::format("darb_{:03d}.png", n);
        if (fs::symlink_status(file).type() == fs::file_type::not_found) return file;
    }
}

constexpr const char* kNoSurface = "There is no surface at this point.";

/// Surfaces are found in straight pictures.
void refuse_bent(const Camera& camera, const char* what, const Session& s) {
    if (camera.lens.active && s.display.effects.lens)
        throw Error(what, "the picture is bent by the photo's lens",
                    "Turn the view a little, which leaves the photo's camera, or turn the effect "
                    "lens off.");
}

template <class... Kinds>
struct ByKind : Kinds... {
    using Kinds::operator()...;
};
template <class... Kinds>
ByKind(Kinds...) -> ByKind<Kinds...>;

}  // namespace

void Controller::take_loaded() {
    session_->attempt([&] {
        std::optional<LoadedScene> loaded = document_->take_loaded();
        if (loaded) take(std::move(*loaded));
    });
    session_->attempt([&] { document_->load_next(); });
}

void Controller::take(LoadedScene loaded) {
    if (loaded.merges && session_->scene)
        merge(std::move(loaded));
    else if (document_->edited_meanwhile())
        session_->leaving = Leaving{false, loaded.asked_for};
    else
        show(std::move(loaded));
}

void Controller::finish_loading() {
    while (document_->loading()) {
        if (std::optional<LoadedScene> loaded = document_->take_loaded(true))
            take(std::move(*loaded));
        document_->load_next();
    }
}

void Controller::take_pictures_of_run() {
    session_->attempt([&] {
        while (const std::optional<LiveMade> made = document_->take_picture_of_run())
            painter_->show_picture_of_run(*made);
    });
}

// The device's copy is made first: when that fails, the previous scene is still there.
void Controller::show(LoadedScene loaded) {
    auto scene = std::make_unique<Scene>(std::move(loaded.scene));
    const bool edited = scene->project != nullptr;
    painter_->open(*scene);
    painter_->begin_scene(document_->show(std::move(scene), loaded.asked_for, loaded.dropped));
    Session& s = *session_;
    if (edited) show_edits();
    if (s.scene->mesh) painter_->show_mesh(*std::exchange(s.scene->mesh, std::nullopt), true);
    if (const fs::path mesh = document_->take_mesh_to_open(); !mesh.empty()) open_mesh(mesh);
}

void Controller::merge(LoadedScene loaded) {
    Session& s = *session_;
    const std::string from = loaded.scene.file.filename().string();
    if (loaded.scene.project)
        throw Error(from, "is a project, and a project cannot be a layer of another",
                    "Save its layers together as one file, and add that.");
    const Bounds added = loaded.scene.subject;
    const double unit = loaded.scene.model.metres_per_unit, ours = s.edit.facts().metres_per_unit;
    const std::size_t count = document_->merge(std::move(loaded.scene.model),
                                               {loaded.scene.file, scene_name(loaded.asked_for)});
    try {
        show_edits();
    } catch (const std::exception&) {  // no room on the device: everything stays as it was
        s.edit.take_back(s.scene->model);
        show_edits();
        throw;
    }
    if (count > 0) s.ask(request::Frame{added.centre, added.radius});
    std::string said = fmt::format(
        "merged {} splats of {}: they are selected, and 6, 7 and 8 move, turn and "
        "scale them",
        count_text(count), from);
    if (unit > 0 && ours > 0 && std::abs(unit / ours - 1) > 1e-6)
        said += fmt::format(
            "\nA unit of it is {:.4g} m, and of the scene {:.4g} m: scale it by "
            "{:.4g} to have it in its true size.",
            unit, ours, unit / ours);
    for (const std::string& loss : s.edit.losses_together()) said += "\n" + loss;
    s.outliner.active = static_cast<int>(s.edit.layers().size()) - 1;
    s.tell(said);
}

bool Controller::take_input(const Input& input, const ControlFrame& frame) {
    Session& s = *session_;
    const bool adds = input.shift || s.outliner.has(input.x, input.y);
    for (const fs::path& path : input.dropped) s.attempt([&] { drop(path, adds); });
    if (!frame.panels_want_keys)
        for (const Key key : input.pressed) press(key, s);
    document_->follow_photo(frame.width, frame.height);
    Input moves = input;
    if (use_tool(input, frame, s)) moves.left = moves.double_click = false;
    move_camera(moves, frame, s);
    play_path(frame.seconds, s);
    return holds_a_key(input);
}

void Controller::act(int width, int height) {
    Session& s = *session_;
    s.for_window.clear();
    const ByKind act{
        [&](request::FrameAll) { document_->frame_all(width, height); },
        [&](const request::Frame& ball) {
            document_->frame_on({ball.centre, ball.radius}, width, height);
        },
        [&](request::TakePicture) { take_picture(width, height); },
        [&](request::ChooseCamera camera) { document_->choose_camera(camera.view); },
        [&](request::LeavePhoto) { leave_photo(s); },
        [&](request::FollowPlan) { document_->follow_plan(); },
        [&](request::Measure) {
            document_->need_scene("measurement");
            painter_->start_measure(width, height);
        },
        [&](request::ShowOpen open) { show_open(open.purpose); },
        [&](const request::ShowTrain& train) { show_train(train.dataset); },
        [&](const request::Open& open) { open_file(open.file, open.merges); },
        [&](request::ShowEdits) { show_edits(); },
        [&](request::Save) { document_->save(*device_); },
        [&](const request::SaveScene& save) { document_->save_scene(*device_, save.layer); },
        [&](request::SaveProject) { document_->save_project(); },
        [&](request::SaveScript) { document_->save_script(); },
        [&](request::SavePage) { document_->save_page(*device_, width, height); },
        [&](request::LoadPath) { document_->load_path(); },
        [&](request::SavePath) { document_->save_path(); },
        [&](request::ExportPath) {
            document_->need_scene("export");
            painter_->start_export();
        },
        [&](request::FindFreeSpace find) {
            document_->need_scene("search");
            painter_->start_search(find.least_views);
        },
        [&](const request::PickPoint& at) { pick(at, width, height); },
        [&](const request::Flood& from) { flood(from, width, height); },
        [&](const request::OpenMesh& open) { open_mesh(open.file); },
        [&](request::MakeMesh) { make_mesh(); },
        [&](request::SaveMesh) { document_->save_mesh(); },
        [&](request::CloseMesh) { painter_->close_mesh(); },
        [&](request::CancelLoad) { document_->cancel_load(); },
        [&](request::CancelWork) { painter_->cancel_work(); },
        [&](const request::AskRun& ask) { s.run_desk.wishes.push_back(ask.wish); },
        [&](request::Quit) { quit(); },
        [&](request::SaveAndLeave) { save_and_leave(); },
        [&](request::Leave) { leave(); },
        [&](request::Stay) { s.leaving.reset(); },
        [&](request::ToggleFullScreen) {
            s.for_window.push_back(WindowRequest::toggle_full_screen);
        },
        [&](request::LeaveFullScreen) { s.for_window.push_back(WindowRequest::leave_full_screen); },
    };
    for (const Request& request : std::exchange(s.requests, {}))
        s.attempt([&] { std::visit(act, request); });
    s.attempt([&] { document_->remember_up(); });
    document_->wish(width, height);
}

double Controller::expire_toasts() {
    Session& s = *session_;
    // the new message is not drawn yet
    if (std::exchange(told_, s.told) != s.told) painter_->unsettle();
    const auto now = std::chrono::steady_clock::now();
    while (!s.toasts.empty() && s.toasts.front().until <= now) s.toasts.pop_front();
    if (s.toasts.empty()) return std::numeric_limits<double>::infinity();
    return std::chrono::duration<double>(s.toasts.front().until - now).count() + 0.001;
}

// Handles a file that a user drops. It is refused during a run, and unsaved edits lead to a
// question first, unless it is added as a layer.
void Controller::drop(const fs::path& path, bool adds) {
    Session& s = *session_;
    if (s.training.live && !s.training.finished)
        s.tell("A run is shown; files can be opened when it is over.");
    else if (s.train_form.offered() && document_->trains_on(path))
        show_train(fs::absolute(path));
    else if (s.scene && !s.scene->is_points && is_mesh_file(path))
        open_mesh(path);  // it is shown with the scene
    else if (adds && s.scene)
        document_->add_later(path);
    else if (unsaved_edits(s) || unsaved_mesh(s))
        s.leaving = Leaving{false, path};
    else
        document_->load(path, true);
}

void Controller::show_open(OpenFor purpose) {
    OpenDialog& dialog = session_->open_dialog;
    dialog.shown = !dialog.shown || dialog.purpose != purpose;
    dialog.purpose = purpose;
    dialog.recent = document_->recent();
    if (!dialog.folder.empty()) dialog.entries = list_folder(dialog.folder, purpose);
}

void Controller::show_train(const fs::path& dataset) {
    TrainForm& form = session_->train_form;
    if (!form.offered() || form.runs) return;
    form.shown = true;
    TrainField* const field = form.field(kDatasetField);
    if (dataset.empty() || field == nullptr) return;
    field->typed = dataset.string();
    ++form.version;
}

void Controller::open_file(const fs::path& file, bool merges) {
    if (!merges) return drop(file);
    document_->need_scene("merging");
    document_->load(file, true, true);
}

void Controller::show_edits() {
    if (!session_->scene) return;
    document_->follow_edits();
    painter_->show_edits();
}

void Controller::open_mesh(const fs::path& file) {
    document_->need_scene("mesh");
    check_mesh_file(file);
    painter_->start_mesh(
        [file](const MeshProgress& progress) { return read_shown_mesh(file, progress); });
}

void Controller::make_mesh() {
    document_->need_scene("mesh");
    if (session_->scene->is_points)
        throw Error("mesh", "is made of splats, and the scene has only points",
                    "Open a scene of splats, such as darb train makes.");
    painter_->start_mesh_of_scene();
}

// Where a mesh is shown, points are on it; where it is among splats, else on these.
void Controller::pick(const request::PickPoint& at, int width, int height) {
    Session& s = *session_;
    document_->need_scene("measuring");
    const Camera camera = camera_in_window(s.photos, s.navigation, free_area(s, width, height));
    const bool on_mesh = s.mesh && s.display.mesh != MeshShow::none;
    std::optional<glm::dvec3> point;
    if (on_mesh) point = point_on_mesh(s.mesh->mesh, camera, double{s.display.near_plane}, at.px);
    if (!on_mesh) refuse_bent(camera, "measuring", s);
    if (!point && !(on_mesh && s.display.mesh == MeshShow::alone))
        point = painter_->surface_at(camera, at.px);
    if (point)
        add_measured_point(*point, at.replaces, s);
    else
        s.tell(kNoSurface);
    painter_->unsettle();
}

// From the surface that is seen there, not from a faint splat that floats before it.
void Controller::flood(const request::Flood& from, int width, int height) {
    Session& s = *session_;
    document_->need_scene("flood");
    const Camera camera = camera_in_window(s.photos, s.navigation, free_area(s, width, height));
    refuse_bent(camera, "flood", s);
    if (const auto point = painter_->surface_at(camera, from.px)) {
        const edits::Select select{by::Flood{*point, double{s.tools.tolerance}}, from.combine};
        darb::show_edit(s.edit.perform(select, s.scene->model), s);
    } else {
        s.tell(kNoSurface);
    }
    painter_->unsettle();
}

void Controller::take_picture(int width, int height) {
    const bool of_run = document_->follows_run();
    if (!of_run) document_->need_scene("picture");
    const std::optional<ImageU8> taken = painter_->picture_alone(width, height, of_run);
    if (!taken) return;
    const fs::path file = free_picture_name();
    write_png(file, *taken);
    session_->tell("picture in " + file.string());
}

// Asks first where something is not saved.
void Controller::quit() {
    if (asks_before_quitting(*session_))
        session_->leaving = Leaving{true, {}};
    else
        session_->for_window.push_back(WindowRequest::close);
}

void Controller::leave() {
    if (!session_->leaving) return;
    const Leaving leaving = *std::exchange(session_->leaving, std::nullopt);
    if (leaving.quit)
        session_->for_window.push_back(WindowRequest::close);
    else
        document_->load(leaving.open, true);
}

// Where saving fails, the viewer stays open and shows the message.
void Controller::save_and_leave() {
    const std::optional<Leaving> leaving = std::exchange(session_->leaving, std::nullopt);
    if (unsaved_edits(*session_)) document_->save(*device_);
    if (unsaved_mesh(*session_)) document_->save_mesh();
    session_->leaving = leaving;
    leave();
}

}  // namespace darb
