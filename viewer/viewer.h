// SPDX-License-Identifier: MIT
// Viewer: a scene, its camera and its panels, drawn into a canvas; with a window or without one. It
// has three parts: what is shown (Document), how it is painted (Painter), what was asked
// (Controller).
#pragma once

#include <chrono>

#include "viewer/controller.h"
#include "viewer/document.h"
#include "viewer/painter.h"
#include "viewer/session.h"

namespace darb {

class Viewer {
  public:
    /// window: null without one.
    Viewer(Device& device, const ViewerOptions& options, GLFWwindow* window = nullptr);

    /// Loads in the background; the scene before stays until the new one is there, and also when
    /// that fails: session().error then says why. An earlier load is cancelled.
    void open(const std::filesystem::path& path);
    bool loading() const { return document_.loading(); }
    /// Waits for the load. Throws its Error.
    void finish_loading();
    /// Shows the pictures of a training run, which stay where they are until end_live; see
    /// TrainingCurves for the rest.
    void show_live(LivePicture& pictures, const Bounds& bounds, const LiveScene& scene);
    /// The last picture stays until a scene is opened, which is shown where the user looked at the
    /// run.
    void end_live();

    /// Looks through camera n of the data set. Throws Error where there is no such camera.
    void choose_camera(int n) { document_.choose_camera(n); }

    /// One frame: input, panels, the picture where something changed, all of it into the canvas.
    /// full: the whole picture at once, no coarse one in motion. Returns seconds until the next
    /// frame is wanted: 0 at once, infinity when nothing happens by itself.
    double frame(const Input& input, int width, int height, bool full);
    /// Full frames until the panels, too, have found their size and show the picture's times.
    void draw_whole(int width, int height);
    /// The canvas was shown: the whole frame's time is known.
    void presented() { painter_.presented(); }

    /// Records the canvas's commands; run by the caller (Canvas::submit_and_wait).
    void compose() { painter_.compose(); }
    Canvas& canvas() { return painter_.canvas(); }
    Session& session() { return session_; }
    const SplatPicture& picture() const { return painter_.picture(); }
    /// Size of the panels, 1 on ordinary screens.
    void set_gui_scale(float scale);
    /// Exports the session's path; blocks. For use without a window. Throws Error.
    void export_path_now();
    /// The picture is whole, and one in motion would have nothing to wait for.
    bool at_rest() const { return !loading() && painter_.at_rest(); }
    /// It has all pixels, and the most important splats at least.
    bool refined() const { return painter_.refined(); }
    /// No levels of merged splats for motion are being made.
    bool levels_ready() const { return painter_.levels_ready(); }

  private:
    double start_clock();

    Session session_;
    Document document_;
    Painter painter_;
    Controller controller_;
    bool continuous_ = false;  // the last frame wanted this one at once
    std::chrono::steady_clock::time_point last_frame_ = std::chrono::steady_clock::now();
};

}  // namespace darb
