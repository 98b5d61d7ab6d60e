// Requests: what panels, keys and the window ask of the viewer. They wait in a queue, and the
// viewer does them in order after the panels of a frame.
#pragma once

#include <algorithm>
#include <filesystem>
#include <glm/glm.hpp>
#include <variant>
#include <vector>

namespace darb {

namespace request {

struct FrameAll {};
struct Frame {
    glm::dvec3 centre{0.0};
    double radius = 1;  // world
};
struct TakePicture {};
struct ChooseCamera {
    int view = 0;  // of the data set
};
struct LeavePhoto {};
struct FollowPlan {};  // the effects as they are planned
struct Measure {};     // accuracy settings and effects
struct ShowOpen {
    bool merges = false;
};  // the dialog
struct Open {
    std::filesystem::path file;
    bool merges = false;  // into the scene that is there
};
struct ShowEdits {};  // other splats are deleted, selected or moved now
struct Save {};       // the edited scene
struct SavePage {};   // the same as a web page
struct LoadPath {};
struct SavePath {};
struct ExportPath {};
struct CancelLoad {};
struct CancelWork {};  // an export, a measurement
struct Quit {};
// Answers to the question of session.leaving.
struct SaveAndLeave {};
struct Leave {};
struct Stay {};
// For the window.
struct ToggleFullScreen {};
struct LeaveFullScreen {};

}  // namespace request

using Request =
    std::variant<request::FrameAll, request::Frame, request::TakePicture, request::ChooseCamera,
                 request::LeavePhoto, request::FollowPlan, request::Measure, request::ShowOpen,
                 request::Open, request::ShowEdits, request::Save, request::SavePage,
                 request::LoadPath, request::SavePath, request::ExportPath, request::CancelLoad,
                 request::CancelWork, request::Quit, request::SaveAndLeave, request::Leave,
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

/// What is left to the window after a frame.
enum class WindowRequest { toggle_full_screen, leave_full_screen, close };

}  // namespace darb
