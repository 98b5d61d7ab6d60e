// Viewer: a scene, its camera and its panels, drawn into a canvas; with a window or without one.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/accuracy_measure.h"
#include "viewer/canvas.h"
#include "viewer/gui.h"
#include "viewer/motion.h"
#include "viewer/path_export.h"
#include "viewer/session.h"
#include "viewer/splat_picture.h"

namespace darb {

struct ViewerOptions {
    std::vector<View> views;  // cameras of a data set, may be none
    std::string up;           // x, -x, ...; "" = from the cameras, else -y
    float gui_scale = 0;      // size of the panels; 0: as the display wants it
    Accuracy accuracy;        // to start with
    EffectChoice effects;     // on top of what a scene calls for
    /// The file that a path means (an output folder names its last scene). Throws Error.
    std::function<std::filesystem::path(const std::filesystem::path&)> resolve;
    /// Cameras that lie beside a scene, for one that is dropped; where there is no such function,
    /// views stay. What it throws is a note.
    std::function<std::vector<View>(const std::filesystem::path&)> find_cameras;
    /// Called from other threads when there is something to show.
    std::function<void()> wake;
};

class Viewer {
  public:
    /// window: null without one.
    Viewer(Device& device, ViewerOptions options, GLFWwindow* window = nullptr);
    ~Viewer();

    /// Loads in the background; the scene before stays until the new one is there, and also when
    /// that fails: session().error then says why. An earlier load is cancelled.
    void open(const std::filesystem::path& path);
    bool loading() const { return job_ != nullptr; }
    /// Waits for the load. Throws its Error.
    void finish_loading();
    /// Follows splats that someone else changes; see TrainingCurves for the rest.
    /// The splats must stay where they are until end_live.
    void show_live(const GpuSplats& splats, const Bounds& bounds);
    /// A scene that is opened next is shown where the user looked at the run.
    void end_live();

    /// Looks through camera n of the data set. Throws Error where there is no such camera.
    void choose_camera(int n);

    /// One frame: input, panels, the picture where something changed, all of it into the canvas.
    /// full: the whole picture at once, no coarse one in motion. Returns seconds until the next
    /// frame is wanted: 0 at once, infinity when nothing happens by itself.
    double frame(const Input& input, int width, int height, bool full);
    /// Full frames until the panels, too, have found their size and show the picture's times.
    void settle(int width, int height);
    /// The canvas was shown: the whole frame's time is known.
    void presented();

    /// Records the canvas's commands; run by the caller (Canvas::submit_and_wait).
    VkCommandBuffer compose();
    Canvas& canvas() { return canvas_; }
    Session& session() { return session_; }
    const SplatPicture& picture() const { return picture_; }
    Gui& gui() { return gui_; }
    /// Size of the panels, 1 on ordinary screens.
    void set_gui_scale(float scale);
    /// Exports the session's path; blocks. For use without a window. Throws Error.
    void export_path_now();
    /// The picture is whole, and one in motion would have nothing to wait for.
    bool at_rest() const;
    /// It has all pixels, and the most important splats at least.
    bool refined() const;

  private:
    using Clock = std::chrono::steady_clock;
    /// The panels show a picture's times in the next frame, and have their size in the one after.
    static constexpr int kSettlingFrames = 2;
    struct PictureKey {  // what a picture depends on
        Camera camera;
        DisplaySettings display;
        int photo = -1;
        float split = 0;
        int version = 0;
        bool operator==(const PictureKey& other) const;
    };

    void start_load(const std::filesystem::path& path, bool dropped);
    void poll_load();
    void drop(const std::filesystem::path& path);
    void adopt(Scene scene);
    void find_own_cameras(Scene& scene);
    void set_pivot(const Bounds& bounds);
    void show_as_meant(const Scene& scene, bool first);
    void follow_plan();
    void handle_keys(const Input& input);
    void move(const Input& input, double seconds, int width, int height);
    void leave_photo();
    bool act_on_requests(int width, int height);
    bool attempt(const std::function<void()>& step);
    void need_scene(const char* what) const;
    void frame_all(int width, int height);
    void cancel_load();
    void apply_edits();
    void save_scene();
    void answer_leaving(const Requests& requests, bool saved);
    void take_picture(int width, int height);
    void start_export();
    void stop_work(const char* why);
    void load_current_photo();
    void play_path(double seconds);
    Camera frame_camera(int width, int height) const;
    PhotoOverlay overlay(const Camera& camera, int width, int height) const;
    void draw_picture(const PictureKey& key, std::optional<MotionQuality> less = {});
    bool preview_pays() const;
    void rehearse_motion(const PictureKey& key);
    double settle_panels(bool changed);
    void step_export(bool wait);
    void step_measure();
    void report(const std::exception& error);

    Device* device_;
    ViewerOptions options_;
    Session session_;
    Canvas canvas_;
    Gui gui_;
    SplatPicture picture_;
    MotionControl motion_;
    std::unique_ptr<LoadJob> job_;
    std::filesystem::path named_;  // what job_ loads, as it was asked for
    bool dropped_ = false;         // it was dropped
    std::vector<std::unique_ptr<LoadJob>> cancelled_;
    std::optional<PathExport> export_;
    std::optional<AccuracyMeasure> measure_;
    PictureKey drawn_, last_;
    // What the picture now is; a preview has all pixels and the most important splats.
    bool drawn_any_ = false, drawn_moving_ = false, drawn_preview_ = false;
    int version_ = 0;                  // of the scene and its edits
    bool drew_moving_ = false;         // in this frame
    bool continuous_ = false;          // the last frame wanted this one at once
    int unsettled_ = kSettlingFrames;  // frames until the panels have settled
    Clock::time_point frame_start_, changed_at_, last_frame_;
};

}  // namespace darb
