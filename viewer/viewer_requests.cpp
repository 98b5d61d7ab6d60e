// What panels and keys asked for: files, edits, paths.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "engine/core/error.h"
#include "engine/data/image_io.h"
#include "engine/scene/splat_file.h"
#include "viewer/viewer.h"

namespace darb {

namespace {

ImageU8 read_pixels(const SplatPicture& picture) {
    ImageU8 image(picture.width(), picture.height(), 3);
    const size_t pixels = size_t(picture.width()) * picture.height();
    const std::vector<std::uint32_t> bgra = picture.pixels().download<std::uint32_t>(pixels);
    for (size_t p = 0; p < pixels; ++p)
        for (size_t c = 0; c < 3; ++c)
            image.data[3 * p + c] = static_cast<std::uint8_t>(bgra[p] >> (16 - 8 * c));
    return image;
}

std::filesystem::path free_name() {
    for (int n = 1;; ++n) {
        const std::filesystem::path file = fmt::format("darb_{:03d}.png", n);
        if (!std::filesystem::exists(file)) return file;
    }
}

}  // namespace

// One that fails leaves the others alone.
bool Viewer::attempt(const std::function<void()>& step) {
    try {
        step();
        return true;
    } catch (const std::exception& e) {
        report(e);
        return false;
    }
}

// True where the picture is now one of an export or a measurement.
bool Viewer::act_on_requests(int width, int height) {
    Session& s = session_;
    const Requests r = s.requests;
    s.requests = Requests();
    s.requests.full_screen = r.full_screen;  // the window's
    s.requests.leave_full_screen = r.leave_full_screen;
    if (r.leave_photo) leave_photo();
    if (r.frame_all) frame_all(width, height);
    if (r.choose_camera >= 0) attempt([&] { choose_camera(r.choose_camera); });
    if (r.cancel_load && job_) cancel_load();
    if (r.opacity_changed && s.scene) attempt([&] { apply_edits(); });
    const bool saves = (r.save || r.save_and_leave) && s.scene;
    answer_leaving(r, saves && attempt([&] { save_scene(); }));
    if (r.take_picture) attempt([&] { take_picture(width, height); });
    if (r.load_path)
        attempt([&] {
            s.path.path = read_camera_path(s.path.file);
            s.note =
                fmt::format("{} key frames from {}", s.path.path.keys.size(), s.path.file.string());
        });
    if (r.save_path)
        attempt([&] {
            write_camera_path(s.path.file, s.path.path);
            s.note = "path in " + s.path.file.string();
        });
    if (r.follow_plan && s.plan) follow_plan();
    if (r.cancel_export) {
        export_.reset();
        measure_.reset();
    }
    if (r.export_path) attempt([&] { start_export(); });
    if (r.measure)
        attempt([&] {
            need_scene("measurement");
            measure_.emplace(frame_camera(width, height), s.display, s.own);
        });
    const bool works = measure_ || (export_ && !export_->has_frames());
    if (export_ && !attempt([&] { step_export(false); })) export_.reset();
    if (measure_ && !attempt([&] { step_measure(); })) measure_.reset();
    s.export_share = export_ ? export_->share() : -1;
    s.measure_share = measure_ ? measure_->share() : -1;
    return works;
}

void Viewer::need_scene(const char* what) const {
    if (picture_.empty())
        throw Error(what, "there is no scene",
                    "Open one: name it on the command line, or drop it on the window.");
}

void Viewer::frame_all(int width, int height) {
    leave_photo();
    const Bounds bounds = picture_.bounds();
    session_.navigation.frame(bounds.centre, bounds.radius, double(width) / height);
}

void Viewer::cancel_load() {
    job_->cancel();
    cancelled_.push_back(std::move(job_));
    session_.load_share = -1;
}

void Viewer::apply_edits() {
    stop_work("the scene was edited");
    picture_.set_removed(session_.edit.removed());
    ++version_;
}

void Viewer::save_scene() {
    Session& s = session_;
    const std::optional<SplatFormat> format = format_to_write(s.save_file);
    if (!format)
        throw Error(s.save_file.string(), "its ending names no format to write",
                    "Use .ply, .compressed.ply, .spz or .splat.");
    const SplatModel model = s.edit.apply(s.scene->model);
    save_splats(s.save_file, *format, model);
    s.edit.mark_saved();
    s.note = fmt::format("saved {} splats to {}", model.size(), s.save_file.string());
    for (const std::string& loss : losses_of(*format, model)) s.note += "\n" + loss;
}

// Quitting, or another scene, would take edits away that are not saved.
void Viewer::answer_leaving(const Requests& r, bool saved) {
    Session& s = session_;
    const bool unsaved = s.scene && s.edit.unsaved();
    if (r.quit && unsaved) s.leaving = Leaving{true, {}};
    s.requests.quit = r.quit && !unsaved;
    if (!s.leaving) return;
    const bool leaves = r.leave || (r.save_and_leave && saved);
    if (!leaves && !r.stay && !r.save_and_leave) return;
    const Leaving leaving = *std::exchange(s.leaving, std::nullopt);
    if (!leaves) return;
    if (leaving.quit)
        s.requests.quit = true;
    else
        start_load(leaving.open, true);
}

void Viewer::take_picture(int width, int height) {
    need_scene("picture");
    const Camera camera = frame_camera(width, height);
    picture_.render(camera, session_.display, overlay(camera, width, height));
    const std::filesystem::path file = free_name();
    write_png(file, read_pixels(picture_));
    session_.note = "picture in " + file.string();
}

void Viewer::start_export() {
    need_scene("export");
    const PathState& p = session_.path;
    export_.reset();  // an earlier one may be writing the same video
    export_.emplace(
        p.path, ExportOptions{p.folder, p.fps, p.export_width, p.export_height, session_.display});
}

// The frames of an export, and the pictures of a measurement, are of one scene.
void Viewer::stop_work(const char* why) {
    measure_.reset();
    if (!export_ || export_->has_frames()) return;
    session_.note = fmt::format("the export ended after {} of {} frames: {}", export_->written(),
                                export_->frame_count(), why);
    export_.reset();
}

void Viewer::step_export(bool wait) {
    export_->step(
        [&](const Camera& camera, const DisplaySettings& display) {
            drawn_any_ = false;  // the picture is one of the export now
            picture_.render(camera, display, {});
            return read_pixels(picture_);
        },
        wait);
    if (!export_->done()) return;
    session_.note = export_->summary();
    export_.reset();
    unsettled_ = kSettlingFrames + 1;  // the panels say so
}

void Viewer::step_measure() {
    drawn_any_ = false;
    measure_->step([&](const Camera& camera, const DisplaySettings& display) {
        double ms = 0;
        for (int i = 0; i < 3; ++i) {  // the first may compile; the lesser of the others counts
            picture_.render(camera, display, {});
            double sum = 0;
            for (const PassTime& pass : picture_.pass_times())
                if (pass.name != "display") sum += pass.ms;
            if (i > 0) ms = i == 1 ? sum : std::min(ms, sum);
        }
        return AccuracyMeasure::Frame{read_pixels(picture_), ms};
    });
    session_.measured = measure_->results();
    if (measure_->done()) measure_.reset();
}

void Viewer::export_path_now() {
    start_export();
    while (export_) step_export(true);
}

}  // namespace darb
