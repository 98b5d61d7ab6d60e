// SPDX-License-Identifier: MIT
// Document: what is shown. The scene with its edits and their history, the cameras that look at it,
// the training run that is followed; how each is meant to be shown, and what of it is in files. It
// draws nothing.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/live_picture.h"
#include "viewer/saved_files.h"
#include "viewer/scene.h"
#include "viewer/session.h"

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

class Document {
  public:
    Document(Session& session, ViewerOptions options);

    /// Loads in the background, an earlier load is cancelled. dropped: by a user, rather than named
    /// on the command line. Throws Error.
    void load(const std::filesystem::path& path, bool dropped, bool merges = false);
    bool loading() const { return loader_.loading(); }
    void cancel_load();
    /// What a load ended with, if one did; wait: until it does. Throws its Error.
    std::optional<LoadedScene> take_loaded(bool wait = false);
    /// There are unsaved edits that are younger than the load.
    bool edited_meanwhile() const;
    /// It is what is shown now; asked: the path that meant it, dropped: as for load. Returns
    /// whether it is that of the run that was shown, and so seen from where the user looked at the
    /// run.
    bool show(std::unique_ptr<Scene> scene, const std::filesystem::path& asked, bool dropped);
    /// Adds its splats to those of the scene, selected. Returns how many. Throws Error.
    std::size_t merge(SplatModel added);
    /// What follows from the splats, where edits changed them: bounds, subject, degree. Not while a
    /// hand moves them.
    void follow_edits();

    /// The pictures stay where they are until end_run.
    void follow_run(LivePicture& pictures, const Bounds& bounds, const LiveScene& scene);
    bool follows_run() const { return live_ != nullptr; }
    /// The run's next picture, if there is one, and what goes with it.
    std::optional<LiveMade> take_picture_of_run();
    /// What the run is to draw for a window of this size, when it comes to it.
    void wish(int width, int height);
    void end_run();

    /// Neither a scene nor a run.
    bool empty() const { return !follows_run() && !session_->scene; }
    /// Throws Error where there is no scene, naming what it is needed for.
    void need_scene(const char* what) const;

    /// Looks through camera n of the data set. Throws Error where there is no such camera.
    void choose_camera(int n);
    /// The picture does not jump where the free camera takes over from a photo's.
    void follow_photo(int width, int height);
    void frame_all(int width, int height) { frame_on(shown_subject(), width, height); }
    void frame_on(const Bounds& bounds, int width, int height);
    /// Effects as they are planned.
    void follow_plan();
    /// Where the user has turned what is up, it is kept for the next time. Throws Error.
    void remember_up();

    void load_path();
    void save_path();
    /// The edited scene. device: for what a format computes there. Throws Error.
    void save_scene(Device& device);
    /// The same as a web page, which opens at what the window shows. Throws Error.
    void save_page(Device& device, int width, int height);
    /// Of scenes that were opened, latest first.
    std::vector<std::filesystem::path> recent() const { return recent_.read(); }

  private:
    void find_own_cameras(const std::filesystem::path& scene, std::vector<std::string>& notes);
    void find_subject(Scene& scene) const;
    Subject shown_subject() const;
    void set_pivot();
    void show_as_meant(const Scene& scene, bool first);
    void show_degree(int degree);
    void first_look(bool of_run);
    void show_as_trained(const LiveScene& scene, bool first);

    Session* session_;
    ViewerOptions options_;
    SceneLoader loader_;
    SavedFiles saved_;
    RememberedUp remembered_;
    RecentFiles recent_;
    int edit_at_load_ = 0;      // Edit::content when a load was started
    int measured_model_ = 0;    // Edit::model_version that bounds and subject are of
    glm::dvec3 known_up_{0.0};  // of the scene, as it was opened or last remembered
    LivePicture* live_ = nullptr;
    Bounds live_bounds_;  // of its subject
    LiveScene live_scene_;
};

}  // namespace darb
