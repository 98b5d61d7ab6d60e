// SPDX-License-Identifier: MIT
// Session: everything that the panels show and edit, in three parts. Panels change it and make
// requests, and the viewer carries them out.
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/plan/effect_plan.h"
#include "engine/scene/edit.h"
#include "engine/scene/region.h"
#include "viewer/camera_path.h"
#include "viewer/display.h"
#include "viewer/guides.h"
#include "viewer/input.h"
#include "viewer/layers.h"
#include "viewer/mesh_work.h"
#include "viewer/navigation.h"
#include "viewer/panes.h"
#include "viewer/photo_compare.h"
#include "viewer/picture_pacing.h"
#include "viewer/saved_files.h"
#include "viewer/scene.h"
#include "viewer/thumbnails.h"
#include "viewer/tools.h"
#include "viewer/train_form.h"

namespace darb {

struct PathState {
    CameraPath path;
    std::vector<KeyFrame> saved;  // as they are in a file
    std::filesystem::path file = "camera_path.json";
    std::filesystem::path folder = "frames";
    float seconds_per_key = 2;
    double at_s = 0;
    bool playing = false;
    int fps = 30;
    int export_width = 1280, export_height = 720;

    void mark_saved() { saved = path.keys; }
    bool unsaved() const { return !path.keys.empty() && path.keys != saved; }
};

/// What a training run reports, iteration by iteration.
struct TrainingCurves {
    bool live = false, finished = false;
    int iteration = 0, last_iteration = 0;
    std::vector<float> loss, psnr_db, splats;  // smoothed, and thinned out as they get long
    std::vector<float> held_out_psnr_db;       // one value for each evaluation
    std::vector<int> held_out_at;              // iterations of these
    double seconds_left = 0;                   // 0: not known yet
    std::uint64_t memory_bytes = 0;            // of the device, in use
    RunSettings settings;                      // as they are
    std::vector<std::string> said;             // what became of wishes, latest last
    bool paused = false;
    int steps_to_go = 0;  // used while paused
};

/// What a user types about a run before it is asked for, and what was asked and not yet passed on.
struct RunDesk {
    std::optional<RunSettings> typed;  // while it differs from what the run has
    bool stopping = false;             // asks how to stop
    bool stopped = false;              // the run was asked to stop
    std::vector<RunWish> wishes;
};

struct FrameTimes {
    std::vector<PassTime> passes;  // times of the last picture
    double picture_ms = 0;         // wall clock time of the last picture
    double frame_ms = 0;           // the whole frame: picture, panels, presentation
    MotionQuality quality;         // the quality of that frame
    std::uint32_t visible = 0, intersections = 0;
    double full_ms = 0;            // time of the last picture at full resolution
    std::deque<double> moving_ms;  // whole frames in motion, latest last
};

/// One choice of one switch, with all others as they are, at one camera.
struct MeasuredChoice {
    int row = 0, choice = 0;  // viewer/switches.h
    double ms = 0;            // device time of the picture's passes
    double psnr_db = 0;       // its 8-bit picture against the exact one; infinity where equal
};

/// Shares from 0 to 1; negative where no such work goes on.
struct WorkProgress {
    double load = -1, exporting = -1, measuring = -1, searching = -1, mesh = -1;
    std::string load_stage, mesh_stage;
};

/// A message over the picture, shown for some seconds.
struct Toast {
    std::string text;
    std::chrono::steady_clock::time_point until;
};

struct OpenDialog {
    bool shown = false;
    OpenFor purpose = OpenFor::showing;
    std::filesystem::path folder;
    std::vector<FolderEntry> entries;           // what the folder holds
    std::vector<std::filesystem::path> recent;  // latest first
    std::filesystem::path counted;              // the folder whose photos were counted
    std::size_t photos = 0;
};

/// A box or a sphere whose splats an edit selects or deletes.
struct Selection {
    Region region;
    bool shown = false;
};

/// The project that is open or would be saved.
struct ProjectState {
    std::filesystem::path file;        // as it was opened or saved; empty: none yet
    std::filesystem::path to_save;     // where it is saved next
    std::filesystem::path first_file;  // of the scene that was opened first, with its first name
    std::string first_name;
    std::filesystem::path cameras;  // that the project names; empty: none
};

/// The list of layers in the panel.
struct OutlinerState {
    int version = -1;                 // Edit::version of the next two
    std::vector<std::size_t> splats;  // of each layer that are not deleted
    std::vector<std::string> losses;  // Edit::losses_together
    std::size_t count = 0;            // layers when the list was drawn last
    int active = 0;                   // the layer whose numbers are shown
    bool editing = false;             // whether a number is being typed
    LayerPose pose;                   // while it is
    std::string renaming;             // the name that is being typed; empty: none
    bool shown = false;               // whether the list was drawn in the last frame
    glm::dvec2 low{0.0}, high{0.0};   // its corners, px of the window
    /// Whether a file dropped there is added.
    bool has(double x, double y) const {
        return shown && x >= low.x && x <= high.x && y >= low.y && y <= high.y;
    }
};

/// The note whose words are being typed.
struct NoteDraft {
    SceneNote note;
    int replaces = -1;  // the note that it changes; -1: a new one
};

/// A request to quit or to open another scene, asked for while edits are not saved.
struct Leaving {
    bool quit = false;
    std::filesystem::path open;  // what to open; empty to quit
};

/// What is shown (viewer/document.h).
struct ShownState {
    std::unique_ptr<Scene> scene;  // null: none yet, or a training run is shown
    Edit edit;
    Selection selection;
    ProjectState project;
    std::filesystem::path save_file;
    std::unique_ptr<ShownMesh> mesh;  // null: none
    MeshWish mesh_wish;
    std::filesystem::path mesh_file;  // where a mesh is saved
    Navigation navigation;
    double fly_speed = 1;            // world units a second
    std::optional<EffectPlan> plan;  // the plan for the scene
    Photos photos;
    PathState path;
    TrainingCurves training;
    RunDesk run_desk;
    Bounds run_bounds;          // of the run that is followed
    std::string title;          // what is shown, for a window's title
    int sh_degree = 0;          // highest degree of the scene or the run
    bool up_is_guess = false;   // neither the file nor the user says what is up
    bool save_upright = false;  // turns a saved scene so that up becomes -y
};

/// What the properties show: a tab each.
enum class Tab { training, scene, view, camera, splats, mesh, measure, film };

/// What the user last worked on, from which the tab follows.
struct Worked {
    Tool tool = Tool::navigate;
    bool selected = false, mesh = false, run = false;
    int camera = -1;
    const void* scene = nullptr;
    std::size_t layers = 0;
};
/// The tab of what has changed; nothing where nothing has that has a tab.
std::optional<Tab> tab_of_change(const Worked& before, const Worked& now);

/// How it is painted (viewer/painter.h).
struct PaintedState {
    DisplaySettings display, own;  // own: how the scene is meant to be shown
    Panes panes;
    FrameTimes times;
    std::vector<MeasuredChoice> measured;
    std::string device_name;
    float gui_scale = 1;
    bool panels = true;
    GuideState guides;
    std::unique_ptr<Thumbnails> thumbnails;  // of photos.views
    Tab tab = Tab::scene;
    Worked worked;
};

/// What was asked, and what is answered (viewer/controller.h).
struct AskedState {
    RequestQueue requests;
    std::vector<WindowRequest> for_window;  // from the last frame
    ToolState tools;
    OpenDialog open_dialog;
    TrainForm train_form;
    OutlinerState outliner;
    NoteDraft note_draft;
    std::optional<Leaving> leaving;  // waits for an answer
    WorkProgress progress;
    std::string error;         // shown until it is dismissed
    std::string note;          // shown in the status line, set by tell
    std::deque<Toast> toasts;  // latest last
    int told = 0;              // counts all toasts so far
    bool help = false;         // whether the list of keys is shown
    bool close_menus = false;  // in the next frame
    /// Called from other threads when there is something new to show; may be empty.
    std::function<void()> wake;

    void ask(const Request& request) { requests.push_back(request); }
    /// Shows the text in the status line and over the picture.
    void tell(const std::string& text);
    /// Runs a step and shows its error, so that other steps go on. Returns whether it succeeded.
    bool attempt(const std::function<void()>& step);
};

/// All three parts, for the panels.
struct Session : ShownState, PaintedState, AskedState {};

/// Whether closing the window ends something that goes on or loses something.
bool asks_before_quitting(const Session& session);

inline bool unsaved_edits(const ShownState& s) {
    return s.scene && s.edit.unsaved();
}
/// Whether a mesh was made that is in no file.
inline bool unsaved_mesh(const ShownState& s) {
    return s.mesh && s.mesh->file.empty();
}

/// Draws the panels of one frame; progress, errors and questions also where session.panels is off.
/// It needs an ImGui frame, whose coordinates it uses.
void draw_panels(Session& session);
/// A window of this size, px, without what the panel covers, where enough room is left beside it.
WindowArea free_area(const Session& session, int width, int height);

}  // namespace darb
