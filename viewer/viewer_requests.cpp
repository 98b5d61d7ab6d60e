// What panels and keys asked for: files, edits, paths.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "engine/core/error.h"
#include "engine/data/image_io.h"
#include "engine/scene/splat_file.h"
#include "viewer/view_camera.h"
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

Camera camera_of(const KeyFrame& key, int width, int height) {
    Navigation view;
    apply(key, view);
    return view.camera(width, height);
}

}  // namespace

void Viewer::act_on_requests(int width, int height) {
    Session& s = session_;
    const Requests r = s.requests;
    s.requests = Requests();
    s.requests.quit = r.quit;
    s.requests.full_screen = r.full_screen;  // the window's
    s.requests.leave_full_screen = r.leave_full_screen;
    try {
        if (r.frame_all) {
            leave_photo();
            const Bounds bounds = picture_.bounds();
            s.navigation.frame(bounds.centre, bounds.radius, double(width) / height);
        }
        if (r.cancel_load && job_) {
            job_->cancel();
            cancelled_.push_back(std::move(job_));
            s.load_share = -1;
        }
        if (r.opacity_changed && s.scene) {
            picture_.set_removed(s.edit.removed());
            ++version_;
        }
        if (r.save && s.scene) {
            const std::optional<SplatFormat> format = format_to_write(s.save_file);
            if (!format)
                throw Error(s.save_file.string(), "its ending names no format to write",
                            "Use .ply, .compressed.ply, .spz or .splat.");
            save_splats(s.save_file, *format, s.edit.apply(s.scene->model));
            s.note =
                fmt::format("saved {} splats to {}", s.scene->model.size() - s.edit.removed_count(),
                            s.save_file.string());
        }
        if (r.take_picture && !picture_.empty()) {
            const Camera camera = frame_camera(width, height);
            picture_.render(camera, s.display, overlay(camera, width, height));
            const std::filesystem::path file = free_name();
            write_png(file, read_pixels(picture_));
            s.note = "picture in " + file.string();
        }
        if (r.load_path) {
            s.path.path = read_camera_path(s.path.file);
            s.note =
                fmt::format("{} key frames from {}", s.path.path.keys.size(), s.path.file.string());
        }
        if (r.save_path) {
            write_camera_path(s.path.file, s.path.path);
            s.note = "path in " + s.path.file.string();
        }
        if (r.export_path) export_.emplace(s.path.path, s.path.folder, s.path.fps);
        if (r.cancel_export) export_.reset();
        if (export_) step_export();
        if (r.follow_plan && s.plan) follow_plan();
        if (r.measure && !picture_.empty()) measure_.emplace(s.display, s.own);
        if (r.cancel_export) measure_.reset();
        if (measure_) step_measure(width, height);
    } catch (const std::exception& e) {
        export_.reset();
        measure_.reset();
        report(e);
    }
    s.export_share = export_ ? export_->share() : -1;
    s.measure_share = measure_ ? measure_->share() : -1;
}

void Viewer::step_export() {
    const PathState& p = session_.path;
    export_->step([&](const KeyFrame& key) {
        picture_.render(camera_of(key, p.export_width, p.export_height), session_.display, {});
        return read_pixels(picture_);
    });
    drawn_any_ = false;  // the picture is one of the export now
    if (!export_->done()) return;
    session_.note = export_->summary();
    export_.reset();
}

void Viewer::step_measure(int width, int height) {
    const Camera camera = frame_camera(width, height);
    measure_->step([&](const DisplaySettings& display) {
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
    drawn_any_ = false;
    session_.measured = measure_->results();
    if (measure_->done()) measure_.reset();
}

void Viewer::export_path_now() {
    const PathState& p = session_.path;
    export_.emplace(p.path, p.folder, p.fps);
    while (export_) step_export();
}

}  // namespace darb
