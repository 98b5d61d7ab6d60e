// SPDX-License-Identifier: MIT
// Document: what is shown. It holds the scene with its edits and their history, the cameras that
// look at it, and the training run that is followed. It knows how each is meant to be shown, and
// what of it has been saved. It draws nothing.
#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "viewer/live_picture.h"
#include "viewer/saved_files.h"
#include "viewer/scene.h"
#include "viewer/session.h"

namespace darb {

struct ViewerOptions {
    std::vector<View> views;     // cameras of a data set; may be empty
    std::filesystem::path mesh;  // shown with the first scene; empty: none
    std::string up;              // x, -x, ...; "" = from the cameras, else remembered or guessed
    StoredUnits units;           // the units of the scenes that `open` names
    bool quiet = false;          // whether to stay silent about what was loaded
    float gui_scale = 0;         // size of the panels; 0: as the display prefers
    std::vector<std::filesystem::path> more;  // scenes to add to the first one, as layers
    std::filesystem::path cameras;            // where `views` come from; empty: found
    Accuracy accuracy;                        // the accuracy to start with
    EffectChoice effects;                     // applied on top of what a scene asks for
    /// Maps a path to the file that it means (an output folder means its last scene). Throws Error.
    std::function<std::filesystem::path(const std::filesystem::path&)> resolve;
    /// Finds cameras that lie beside a scene, for one that is dropped. Without such a function the
    /// views stay. What it throws becomes a note.
    std::function<std::vector<View>(const std::filesystem::path&)> find_cameras;
    /// Whether a run can train on what lies there: a folder of photos, a data set, a video. Without
    /// such a function nothing counts as one of these.
    std::function<bool(const std::filesystem::path&)> trains_on;
    /// Whether a scene with cameras opens at the first one, with its photo where there is one.
    bool start_at_camera = false;
    /// A device like the viewer's, which compiles while the last picture of a run is shown.
    std::optional<DeviceOptions> second_device;
    std::filesystem::path up_list;      // the file of RememberedUp
    std::filesystem::path recent_list;  // the file of RecentFiles
    /// Called from other threads when there is something new to show.
    std::function<void()> wake;
};

class Document {
  public:
    Document(Session& session, ViewerOptions options);

    /// Loads in the background and cancels an earlier load. dropped: by a user, rather than named
    /// on the command line. Throws Error.
    void load(const std::filesystem::path& path, bool dropped, bool merges = false);
    bool loading() const { return loader_.loading(); }
    /// Adds this scene as a layer when those that wait before it are there.
    void add_later(const std::filesystem::path& path) { to_add_.push_back({path, true}); }
    /// Starts the load of the next scene to add, where none is being loaded. Throws Error.
    void load_next();
    void cancel_load();
    /// The result of a load that has ended. wait: waits until it has. Throws the load's Error.
    std::optional<LoadedScene> take_loaded(bool wait = false);
    /// Whether there are unsaved edits that are younger than the load.
    bool edited_meanwhile() const;
    /// Makes the scene the one that is shown. asked: the path that meant it; dropped: as for load.
    /// Returns whether the scene is that of the run that was shown, in which case it is seen from
    /// where the user looked at the run.
    bool show(std::unique_ptr<Scene> scene, const std::filesystem::path& asked, bool dropped);
    /// Adds these splats to the scene as a layer and selects them. source: where they come from.
    /// Returns how many. Throws Error.
    std::size_t merge(SplatModel added, const edits::Add& source);
    /// Updates what follows from the splats after edits: bounds, subject, degree. It waits while a
    /// hand moves splats.
    void follow_edits();

    bool trains_on(const std::filesystem::path& path) const {
        return options_.trains_on && options_.trains_on(path);
    }

    /// Closes the scene that is shown, even with unsaved edits, and takes the cameras of a run.
    void make_room_for_run(std::vector<View> views);
    /// The pictures must stay where they are until end_run.
    void follow_run(LivePicture& pictures, const Bounds& bounds, const LiveScene& scene);
    bool follows_run() const { return live_ != nullptr; }
    /// The run's next picture, if there is one, with what belongs to it.
    std::optional<LiveMade> take_picture_of_run();
    /// Tells the run what to draw next, for a window of this size.
    void wish(int width, int height);
    void end_run();

    /// Whether there is neither a scene nor a run.
    bool empty() const { return !follows_run() && !session_->scene; }
    /// Throws an Error that names the purpose where there is no scene.
    void need_scene(const char* what) const;

    /// Looks through camera n of the data set. Throws Error where there is no such camera.
    void choose_camera(int n);
    /// Keeps the free camera with the photo's camera, so that the picture does not jump when it
    /// takes over.
    void follow_photo(int width, int height);
    void frame_all(int width, int height) { frame_on(shown_subject(), width, height); }
    void frame_on(const Bounds& bounds, int width, int height);
    /// Applies the effects as planned.
    void follow_plan();
    /// Keeps the up direction for the next time where the user has changed it. Throws Error.
    void remember_up();

    /// The mesh that ViewerOptions name, once.
    std::filesystem::path take_mesh_to_open() { return std::exchange(options_.mesh, {}); }
    /// Saves the mesh that is shown. Throws Error where there is none.
    void save_mesh();

    void load_path();
    void save_path();
    /// Saves the project where there is one to keep (keeps_project), else the edited scene. device:
    /// for what a format computes there. Throws Error.
    void save(Device& device);
    /// Saves the visible layers together as one scene, or the layer of this name alone.
    void save_scene(Device& device, const std::string& layer = "");
    void save_project();
    /// Saves the edits as a script for `darb edit`.
    void save_script();
    /// Saves the scene as a web page that opens at the window's view. Throws Error.
    void save_page(Device& device, int width, int height);
    /// The scenes that were opened, latest first.
    std::vector<std::filesystem::path> recent() const { return recent_.read(); }

  private:
    void find_own_cameras(const std::filesystem::path& scene, std::vector<std::string>& notes);
    void find_subject(Scene& scene) const;
    Subject shown_subject() const;
    void begin_edits(Scene& scene, const std::filesystem::path& asked);
    void draw_as_edited();
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
    int edit_at_load_ = 0;  // Edit::content when a load was started
    struct ToAdd {
        std::filesystem::path path;
        bool dropped = false;  // as for load
    };
    std::deque<ToAdd> to_add_;
    int drawn_model_ = 0;       // Edit::model_version for which Scene::drawn was made
    int measured_model_ = 0;    // Edit::model_version for which bounds and subject were measured
    glm::dvec3 known_up_{0.0};  // the scene's up as it was opened or last remembered
    LivePicture* live_ = nullptr;
    Bounds live_bounds_;  // bounds of the live subject
    LiveScene live_scene_;
};

}  // namespace darb
