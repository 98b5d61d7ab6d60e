// SPDX-License-Identifier: MIT
// Viewer: a scene, its camera and its panels, drawn into a canvas, with a window or without one. It
// has three parts: what is shown (Document), how it is painted (Painter), and what was asked
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
    /// window: null for none.
    Viewer(Device& device, const ViewerOptions& options, GLFWwindow* window = nullptr);

    /// Loads in the background and cancels an earlier load. The current scene stays until the new
    /// one is there, and also when that fails; session().error then says why.
    void open(const std::filesystem::path& path);
    bool loading() const { return document_.loading(); }
    /// Waits for the load. Throws its Error.
    void finish_loading();
    /// Closes what is shown, without a question, and takes the cameras of a run that will follow.
    void make_room_for_run(std::vector<View> views);
    /// Shows the pictures of a training run, which must stay where they are until end_live.
    /// TrainingCurves has the rest.
    void show_live(LivePicture& pictures, const Bounds& bounds, const LiveScene& scene);
    /// Ends the run. Its last picture stays until a scene is opened, which is then seen from where
    /// the user looked at the run.
    void end_live();

    /// Looks through camera n of the data set. Throws Error where there is no such camera.
    void choose_camera(int n) { document_.choose_camera(n); }

    /// Makes one frame: takes the input, draws the panels, and the picture where something changed,
    /// all into the canvas. full: draws the whole picture at once, not a coarse one in motion.
    /// Returns the seconds until the next frame is wanted: 0 at once, infinity when nothing happens
    /// by itself.
    double frame(const Input& input, int width, int height, bool full);
    /// Draws full frames until the panels, too, have found their size and show the picture's times.
    void draw_whole(int width, int height);
    /// To be called when the canvas was shown and the whole frame's time is known.
    void presented() { painter_.presented(); }

    /// Records the canvas's commands; the caller runs them (Canvas::submit_and_wait).
    void compose() { painter_.compose(); }
    Canvas& canvas() { return painter_.canvas(); }
    Session& session() { return session_; }
    const SplatPicture& picture() const { return painter_.picture(); }
    /// Sets the size of the panels, 1 on ordinary screens.
    void set_gui_scale(float scale);
    /// Exports the session's path and blocks until it is done. For use without a window. Throws
    /// Error.
    void export_path_now();
    /// Whether the picture is whole and one in motion would not have to wait for anything; and no
    /// mesh is being read or made.
    bool at_rest() const { return !loading() && !painter_.meshes() && painter_.at_rest(); }
    /// Whether the picture has all pixels, and at least the most important splats.
    bool refined() const { return painter_.refined(); }
    /// Whether no levels of merged splats for motion are still being made.
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
