// SPDX-License-Identifier: MIT
// Input: what mouse and keys did since the last frame, independent of any window system.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/scene/select.h"

namespace darb {

/// What can be asked for by a key, a menu or a button; commands.h has the table of them.
enum class Key {
    open,
    merge,
    train,
    save,
    save_page,
    picture,
    quit,
    undo,
    redo,
    remove,
    hide,
    show_hidden,
    select_all,
    select_none,
    select_others,
    frame_all,
    level,
    view_front,
    view_right,
    view_top,
    next_camera,
    last_camera,
    compare,
    show_cameras,
    show_grid,
    show_axes,
    show_picture,
    show_depth,
    show_work,
    show_error,
    hide_panels,
    full_screen,
    tool_navigate,
    tool_rectangle,
    tool_lasso,
    tool_brush,
    tool_sphere,
    tool_move,
    tool_turn,
    tool_scale,
    tool_measure,
    tool_polygon,
    tool_flood,
    add_key,
    play,  // a path, or a training run
    step,  // of a training run
    help,
    escape,
};
inline constexpr int kKeyCount = static_cast<int>(Key::escape) + 1;

struct Input {
    double x = 0, y = 0;    // px, pointer
    double dx = 0, dy = 0;  // px that it moved with a button down since the last frame
    double wheel = 0;       // wheel steps, up is positive
    // Whether each is down now or was during that motion.
    bool left = false, middle = false, right = false, shift = false, control = false;
    bool double_click = false;
    std::vector<glm::dvec2> trail;  // px where it was pressed and dragged with the left button
    // Keys that are held: W S A D E Q.
    bool ahead = false, back = false, to_left = false, to_right = false, rise = false, sink = false;
    std::vector<Key> pressed;
    std::vector<std::filesystem::path> dropped;
};

/// What a file or a folder is chosen for.
enum class OpenFor { showing, adding, training };

/// What of a training run may change while it goes on; 0: as it is.
struct RunSettings {
    int iterations = 0;            // of the whole run
    std::uint32_t max_splats = 0;  // 0 in what a run reports: no limit
    double max_memory_mib = 0;     // of the device, likewise

    bool operator==(const RunSettings&) const = default;
};

/// What is asked of the run, between two iterations.
struct RunWish {
    std::optional<RunSettings> change = {};
    bool measures = false;   // held-out photos
    bool saves = false;      // checkpoint and scene
    bool stops = false;      // as Ctrl-C does
    bool publishes = false;  // and leaves a web page
};

// Requests: what panels, keys and the window ask of the viewer. They wait in a queue, and the
// viewer carries them out in order after the panels of a frame.

namespace request {

struct FrameAll {};
struct Frame {
    glm::dvec3 centre{0.0};
    double radius = 1;  // world
};
struct TakePicture {};
struct ChooseCamera {
    int view = 0;  // index into the data set
};
struct LeavePhoto {};
struct FollowPlan {};  // sets the effects as planned
struct Measure {};     // measures accuracy settings and effects
struct ShowOpen {
    OpenFor purpose = OpenFor::showing;
};  // opens the dialog
struct ShowTrain {
    std::filesystem::path dataset;  // empty: as it was typed
};                                  // opens the form that begins a training run
struct Open {
    std::filesystem::path file;
    bool merges = false;  // adds it to the current scene
};
struct ShowEdits {};  // other splats are deleted, selected or moved now
struct Save {};       // saves the project where there is one to keep, else the edited scene
struct SaveScene {
    std::string layer;
};  // saves the visible layers together as one scene, or a layer alone
struct SaveProject {};
struct SaveScript {};  // saves the edits as a script
struct SavePage {};    // saves it as a web page
struct LoadPath {};
struct SavePath {};
struct ExportPath {};
struct CancelLoad {};
struct FindFreeSpace {
    int least_views = 3;
};                     // selects the splats that so many photos look through
struct CancelWork {};  // an export, a measurement, a search or a mesh
struct PickPoint {
    glm::dvec2 px{0.0};  // of the window
    int replaces = -1;   // the measured point that moves there; -1: a new one
};
struct Flood {
    glm::dvec2 px{0.0};  // of the window: selects from the surface that is seen there
    Combine combine = Combine::replace;
};
struct OpenMesh {
    std::filesystem::path file;
};                   // shows a mesh with the scene
struct MakeMesh {};  // of the scene, as session.mesh_wish says
struct SaveMesh {};
struct CloseMesh {};
struct AskRun {
    RunWish wish;
};  // of the training run that is followed
struct Quit {};
// Answers to the question that session.leaving asks.
struct SaveAndLeave {};
struct Leave {};
struct Stay {};
// Requests for the window.
struct ToggleFullScreen {};
struct LeaveFullScreen {};

}  // namespace request

using Request =
    std::variant<request::FrameAll, request::Frame, request::TakePicture, request::ChooseCamera,
                 request::LeavePhoto, request::FollowPlan, request::Measure, request::ShowOpen,
                 request::ShowTrain, request::Open, request::ShowEdits, request::Save,
                 request::SaveScene, request::SaveProject, request::SaveScript, request::SavePage,
                 request::LoadPath, request::SavePath, request::ExportPath, request::CancelLoad,
                 request::FindFreeSpace, request::CancelWork, request::PickPoint, request::Flood,
                 request::OpenMesh, request::MakeMesh, request::SaveMesh, request::CloseMesh,
                 request::AskRun, request::Quit, request::SaveAndLeave, request::Leave,
                 request::Stay, request::ToggleFullScreen, request::LeaveFullScreen>;
using RequestQueue = std::vector<Request>;

template <class Kind>
bool asks_for(const RequestQueue& queue) {
    return std::any_of(queue.begin(), queue.end(),
                       [](const Request& r) { return std::holds_alternative<Kind>(r); });
}
template <class Kind>
void take_back(RequestQueue& queue) {
    std::erase_if(queue, [](const Request& r) { return std::holds_alternative<Kind>(r); });
}

/// What the window itself must do after a frame.
enum class WindowRequest { toggle_full_screen, leave_full_screen, close };

}  // namespace darb
