// What panels, keys and the window asked for: files, edits, paths.
#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/image_io.h"
#include "engine/publish/device_clusters.h"
#include "engine/publish/web_page.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "viewer/controls.h"
#include "viewer/viewer.h"

namespace darb {

namespace {

namespace fs = std::filesystem;

constexpr double kFilled = 0.94;  // of the free area, by what is framed

// Not one of a link either, to whatever it leads.
fs::path free_picture_name() {
    for (int n = 1;; ++n) {
        const fs::path file = fmt::format("darb_{:03d}.png", n);
        if (fs::symlink_status(file).type() == fs::file_type::not_found) return file;
    }
}

template <class... Kinds>
struct ByKind : Kinds... {
    using Kinds::operator()...;
};
template <class... Kinds>
ByKind(Kinds...) -> ByKind<Kinds...>;

}  // namespace

// One that fails leaves the others alone.
bool Viewer::attempt(const std::function<void()>& step) {
    try {
        step();
        return true;
    } catch (const std::exception& e) {
        session_.error = e.what();
        return false;
    }
}

void Viewer::act_on_requests(int width, int height) {
    Session& s = session_;
    s.for_window.clear();
    const ByKind act{
        [&](request::FrameAll) { frame_on(shown_subject(), width, height); },
        [&](const request::Frame& ball) {
            frame_on({ball.centre, ball.radius}, width, height);
        },
        [&](request::TakePicture) { take_picture(width, height); },
        [&](request::ChooseCamera camera) { choose_camera(camera.view); },
        [&](request::LeavePhoto) { leave_photo(s); },
        [&](request::FollowPlan) { follow_plan(); },
        [&](request::Measure) {
            need_scene("measurement");
            work_.start_measure(
                camera_in_window(s.photos, s.navigation, free_area(s, width, height)), s.display,
                s.own);
        },
        [&](request::ShowOpen open) { show_open(open.merges); },
        [&](const request::Open& open) { open_file(open.file, open.merges); },
        [&](request::ShowEdits) { show_edits(); },
        [&](request::Save) { save_scene(); },
        [&](request::SavePage) { save_page(width, height); },
        [&](request::LoadPath) { load_path(); },
        [&](request::SavePath) { save_path(); },
        [&](request::ExportPath) { start_export(); },
        [&](request::CancelLoad) {
            loader_.cancel();
            s.progress.load = -1;
        },
        [&](request::CancelWork) { work_.cancel(); },
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
        attempt([&] { std::visit(act, request); });
}

void Viewer::need_scene(const char* what) const {
    if (live_ != nullptr)
        throw Error(what, "a run is shown", "Wait for its end: its scene is opened then.");
    if (picture_.empty())
        throw Error(what, "there is no scene",
                    "Open one: name it on the command line, or drop it on the window.");
}

void Viewer::frame_on(const Bounds& bounds, int width, int height) {
    leave_photo(session_);
    Navigation& n = session_.navigation;
    const double panel = free_area(session_, width, height).left, free = width - panel;
    const bool beside = panel > 0 && draws_every_centre(session_.display.effects);
    n.centre_x = beside ? (panel + free / 2) / width : 0.5;
    const double wide = beside ? free : width;
    const double tan_y = std::tan(n.fov_y / 2), tan_x = tan_y * wide / height;
    const double distance = session_.scene ? framing_distance(session_.scene->model, bounds, n.axes,
                                                              kFilled * tan_x, kFilled * tan_y)
                                           : 0;
    if (distance > 0)
        n.look_from(bounds.centre, distance);
    else
        n.frame(bounds.centre, bounds.radius, wide / height);
}

void Viewer::show_open(bool merges) {
    OpenDialog& dialog = session_.open_dialog;
    dialog.shown = !dialog.shown || dialog.merges != merges;
    dialog.merges = merges;
    dialog.recent = recent_.read();
    if (!dialog.folder.empty()) dialog.entries = list_folder(dialog.folder);
}

// While a hand moves splats, only they are made anew; all else follows when it lets go.
void Viewer::show_edits() {
    Session& s = session_;
    if (!s.scene) return;
    if (std::exchange(shown_edit_, s.edit.seen_version()) != s.edit.seen_version())
        lose_scene("the scene was edited");
    if (s.edit.model_version() != shown_model_) {
        Scene& scene = *s.scene;
        if (s.edit.transforms()) {
            picture_.update_scene();
        } else {
            measure_scene(scene);
            find_subject(scene);
            picture_.set_scene(scene.model, scene.bounds, scene.important);
            shares_ = picture_.most_moving() < 1
                          ? motion_shares(picture_.splat_count(), picture_.most_moving())
                          : std::vector<double>();
            pacing_.motion().start(shares_);
            show_degree(scene.model.sh_degree);
        }
        shown_model_ = s.edit.model_version();
    }
    show_marks(!work_.draws());
}

// The highlight of a selection is for who edits: not in pictures that are written or measured.
void Viewer::show_marks(bool highlight) {
    const Edit& edit = session_.edit;
    highlights_ = highlight;
    lose_levels();  // they have none
    ++version_;
    picture_.set_marks(edit.unseen(),
                       highlight ? edit.selected() : SplatMask(edit.selected().size(), 0));
}

void Viewer::load_path() {
    PathState& p = session_.path;
    p.path = read_camera_path(p.file);
    p.mark_saved();
    session_.tell(fmt::format("{} key frames from {}", p.path.keys.size(), p.file.string()));
}

void Viewer::save_path() {
    PathState& p = session_.path;
    saved_.check(p.file);
    write_camera_path(p.file, p.path);
    saved_.wrote(p.file);
    p.mark_saved();
    session_.tell("path in " + p.file.string());
}

void Viewer::save_scene() {
    Session& s = session_;
    if (!s.scene) return;
    const std::optional<SplatFormat> format = format_to_write(s.save_file);
    if (!format)
        throw Error(s.save_file.string(), "its ending names no format to write",
                    "Use " + endings_to_write() + ".");
    saved_.check(s.save_file);
    SplatModel model = s.edit.apply(s.scene->model);
    if (s.save_upright) transform_splats({.turn = turn_to_up(s.navigation.up)}, model);
    DeviceClusters clusters(*device_);
    EncodeOptions options;
    options.assign_rows = clusters.assign_rows();
    write_encoded(s.save_file, encode_scene(*format, model, s.save_file.string(), options));
    saved_.wrote(s.save_file);
    s.edit.mark_saved();
    std::string said = fmt::format("saved {} splats to {}", model.size(), s.save_file.string());
    for (const std::string& loss : losses_of(*format, model)) said += "\n" + loss;
    s.tell(said);
}

// Opens at what the window shows; the cameras of the photos follow.
void Viewer::save_page(int width, int height) {
    Session& s = session_;
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
    // What is seen beside the panel, which a page does not have.
    const int left = free_area(s, width, height).left;
    Navigation centred = s.navigation;
    centred.centre_x = 0.5;
    shown.camera = camera_in_window(s.photos, centred, {width - left, height, 0});
    options.up = s.navigation.up;
    options.views.insert(options.views.begin(), shown);
    WebPageFacts facts;
    write_file_atomic(file, make_web_page(*device_, s.edit.apply(s.scene->model), options, &facts));
    saved_.wrote(file);
    s.tell(fmt::format("web page in {}\n{}", file.string(), web_page_text(facts)));
}

// Not with edits that are not saved, without a question.
void Viewer::quit() {
    if (session_.scene && session_.edit.unsaved())
        session_.leaving = Leaving{true, {}};
    else
        session_.for_window.push_back(WindowRequest::close);
}

void Viewer::leave() {
    if (!session_.leaving) return;
    const Leaving leaving = *std::exchange(session_.leaving, std::nullopt);
    if (leaving.quit)
        session_.for_window.push_back(WindowRequest::close);
    else
        start_load(leaving.open, true);
}

// Where it cannot be saved one stays, with the message.
void Viewer::save_and_leave() {
    const std::optional<Leaving> leaving = std::exchange(session_.leaving, std::nullopt);
    save_scene();
    session_.leaving = leaving;
    leave();
}

void Viewer::take_picture(int width, int height) {
    if (live_ == nullptr) {
        need_scene("picture");
        if (session_.edit.selected_count() > 0) show_marks(false);  // until step_work
        const WindowArea area = free_area(session_, width, height);
        render_shown(camera_in_window(session_.photos, session_.navigation, area), area, {});
        compose_panes();
    }
    const BufferPicture taken = live_ == nullptr ? drawn() : shown();
    if (taken.pixels == nullptr || taken.width == 0) return;  // of a run that has drawn none
    const fs::path file = free_picture_name();
    write_png(file, read_pixels(*taken.pixels, taken.width, taken.height));
    session_.tell("picture in " + file.string());
}

void Viewer::start_export() {
    need_scene("export");
    const PathState& p = session_.path;
    work_.start_export(p.path,
                       {p.folder, p.fps, p.export_width, p.export_height, session_.display});
}

void Viewer::step_export(bool wait) {
    const std::optional<std::string> summary = work_.step_export(picture_, wait);
    if (!summary) return;
    session_.tell(*summary);
    pacing_.unsettle(PicturePacing::kSettlingFrames + 1);  // the panels say so
}

void Viewer::step_work() {
    if (highlights_ == work_.draws() && session_.edit.selected_count() > 0)
        show_marks(!work_.draws());
    if (work_.draws()) {  // the picture is one of its own then
        pacing_.forget();
        shows_panes_ = false;
    }
    if (work_.exports()) attempt([&] { step_export(false); });
    if (work_.measures()) attempt([&] { session_.measured = work_.step_measure(picture_); });
    session_.progress.exporting = work_.export_share();
    session_.progress.measuring = work_.measure_share();
}

void Viewer::export_path_now() {
    start_export();
    pacing_.forget();
    while (work_.exports()) step_export(true);
}

}  // namespace darb
