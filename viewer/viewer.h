// Viewer: a scene, its camera and its panels, drawn into a canvas; with a window or without one.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "viewer/canvas.h"
#include "viewer/gui.h"
#include "viewer/live_picture.h"
#include "viewer/motion_levels.h"
#include "viewer/pane_pictures.h"
#include "viewer/picture_pacing.h"
#include "viewer/picture_work.h"
#include "viewer/recent_files.h"
#include "viewer/remembered_up.h"
#include "viewer/saved_files.h"
#include "viewer/scene_loader.h"
#include "viewer/session.h"
#include "viewer/splat_picture.h"
#include "viewer/warm_up.h"

namespace darb {

struct ViewerOptions {
    std::vector<View> views;  // cameras of a data set, may be none
    std::string up;           // x, -x, ...; "" = from the cameras, else remembered or guessed
    StoredUnits units;        // of the scenes that `open` names
    bool quiet = false;       // says nothing of what it has loaded
    float gui_scale = 0;      // size of the panels; 0: as the display wants it
    Accuracy accuracy;        // to start with
    EffectChoice effects;     // on top of what a scene calls for
    /// The file that a path means (an output folder names its last scene). Throws Error.
    std::function<std::filesystem::path(const std::filesystem::path&)> resolve;
    /// Cameras that lie beside a scene, for one that is dropped; where there is no such function,
    /// views stay. What it throws is a note.
    std::function<std::vector<View>(const std::filesystem::path&)> find_cameras;
    /// Scenes with cameras open at the first, with its photo where there is one.
    bool start_at_camera = false;
    /// Of a device like the viewer's, to compile on while the last picture of a run is shown.
    std::optional<DeviceOptions> second_device;
    std::filesystem::path up_list;      // of RememberedUp
    std::filesystem::path recent_list;  // of RecentFiles
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
    bool loading() const { return loader_.loading(); }
    /// Waits for the load. Throws its Error.
    void finish_loading();
    /// Shows the pictures of a training run, which stay where they are until end_live; see
    /// TrainingCurves for the rest.
    void show_live(LivePicture& pictures, const Bounds& bounds, const LiveScene& scene);
    /// The last picture stays until a scene is opened, which is shown where the user looked at the
    /// run.
    void end_live();

    /// Looks through camera n of the data set. Throws Error where there is no such camera.
    void choose_camera(int n);

    /// One frame: input, panels, the picture where something changed, all of it into the canvas.
    /// full: the whole picture at once, no coarse one in motion. Returns seconds until the next
    /// frame is wanted: 0 at once, infinity when nothing happens by itself.
    double frame(const Input& input, int width, int height, bool full);
    /// Full frames until the panels, too, have found their size and show the picture's times.
    void draw_whole(int width, int height);
    /// The canvas was shown: the whole frame's time is known.
    void presented();

    /// Records the canvas's commands; run by the caller (Canvas::submit_and_wait).
    void compose();
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
    /// No levels of merged splats for motion are being made.
    bool levels_ready() const;

  private:
    using Clock = std::chrono::steady_clock;

    // viewer_scene.cpp: what is shown.
    void start_load(const std::filesystem::path& path, bool dropped, bool merges = false);
    void take_loaded();
    void drop(const std::filesystem::path& path);
    void show(LoadedScene loaded);
    void find_own_cameras(const std::filesystem::path& scene, std::vector<std::string>& notes);
    void show_as_meant(const Scene& scene, bool first);
    void follow_plan();
    void find_subject(Scene& scene) const;
    void set_pivot();
    void start_warm_up();
    void end_warm_up();
    void first_look(bool of_run);
    void remember_up();
    void lose_scene(const char* why);
    void show_as_trained(const LiveScene& scene, bool first);
    void follow_live(int width, int height);
    void take_live(const LiveMade& made);
    bool shows_nothing() const { return live_ == nullptr && picture_.empty(); }
    Subject shown_subject() const;

    // viewer_requests.cpp: what is asked for.
    void act_on_requests(int width, int height);
    bool attempt(const std::function<void()>& step);
    void need_scene(const char* what) const;
    void frame_on(const Bounds& bounds, int width, int height);
    void follow_photo(int width, int height);
    void load_path();
    void save_path();
    void save_scene();
    void show_edits();
    void show_marks(bool highlight);
    void show_open(bool merges);
    void open_file(const std::filesystem::path& file, bool merges);
    void merge(LoadedScene loaded);
    double expire_toasts();
    void save_page(int width, int height);
    void quit();
    void leave();
    void save_and_leave();
    void take_picture(int width, int height);
    void start_export();
    void step_work();
    void step_export(bool wait);

    // viewer_picture.cpp: the picture of a frame.
    void load_current_photo();
    void pace_picture(int width, int height, bool full, bool works);
    std::vector<DisplaySettings> shown_displays() const;  // a pane each
    void show_degree(int degree);
    void render_shown(const Camera& camera, const WindowArea& area, std::optional<double> moving);
    void compose_panes();
    bool ready_to_move() const;
    BufferPicture shown() const;
    BufferPicture drawn() const;  // of the scene, while the run's last picture is still shown too
    void draw_picture(const PictureKey& key, PictureStep step);
    void rehearse_motion(const PictureKey& key);
    void rehearse_once(const PictureKey& key, const MotionQuality& quality, double splats);
    void start_levels();
    void take_levels();
    void lose_levels();

    Device* device_;
    ViewerOptions options_;
    Session session_;
    SceneLoader loader_;
    SavedFiles saved_;
    Canvas canvas_;
    Gui gui_;
    SplatPicture picture_;
    PanePictures panes_;
    bool shows_panes_ = false;  // not picture_
    LivePicture* live_ = nullptr;
    Bounds live_bounds_;  // of its subject
    LiveScene live_scene_;
    Buffer live_pixels_;       // of the run's last picture
    glm::ivec2 live_size_{0};  // px
    PicturePacing pacing_;
    int rehearsals_ = 0;             // of motion, still to come
    double besides_picture_ms_ = 0;  // what a frame took beside its picture, before them
    PictureWork work_;
    RememberedUp remembered_;
    RecentFiles recent_;
    int told_ = 0;                          // Session::told of the last frame
    int shown_model_ = 0, shown_edit_ = 0;  // Edit::model_version, seen_version of the picture
    int edit_at_load_ = 0;                  // Edit::content when a load was started
    glm::dvec3 known_up_{0.0};              // of the scene, as it was opened or last remembered
    std::vector<double> shares_;            // of the splats, below all
    std::unique_ptr<MotionLevels> levels_;  // of the scene; null: none asked for
    std::vector<std::unique_ptr<MotionLevels>> ended_;  // cancelled, their threads still run
    std::unique_ptr<WarmUp> warm_up_;                   // the run's last picture is shown
    std::vector<Pipeline> warm_pipelines_;              // that it made, until pictures have them
    int version_ = 0;                                   // of the scene and its edits
    bool highlights_ = true;                            // what is selected, in the picture
    bool continuous_ = false;                           // the last frame wanted this one at once
    Clock::time_point frame_start_, last_frame_;
};

}  // namespace darb
