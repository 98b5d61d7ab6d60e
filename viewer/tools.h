// Tools: what the left button does to the splats while one is chosen. A stroke selects, a gizmo
// moves, turns and scales what is selected.
#pragma once

#include <optional>
#include <vector>

#include "viewer/edit.h"
#include "viewer/gizmo.h"

namespace darb {

struct Session;
struct Input;
struct ControlFrame;

enum class Tool { navigate, rectangle, lasso, brush, sphere, move, turn, scale };
inline constexpr int kToolCount = 8;

struct ToolState {
    Tool tool = Tool::navigate;
    float brush_px = 40;             // radius, px of the window
    std::vector<glm::dvec2> stroke;  // px, while it is drawn
    bool drawing = false;
    bool ignores = false;  // the button, until it is let go: what it drew was cancelled
    Combine combine = Combine::replace;  // of the stroke
    std::optional<glm::dvec3> sphere;    // centre, world
    std::optional<int> handle;           // of the gizmo that is dragged
    Gizmo gizmo;
    std::optional<glm::dvec3> centre;  // of what a gizmo would move
    int centre_version = -1;           // of the edit that it is of
    // What is selected by value.
    float opacity[2] = {0, 0.1f}, scale[2] = {0, 0.1f};  // scale: world units
    glm::vec3 colour{1.0f};
    float tolerance = 0.1f, grow = 0.01f;  // grow: world units
};

/// What the pointer does to splats, where the panels and with them strokes are shown. Returns
/// whether the left button is the tool's.
bool use_tool(const Input& input, const ControlFrame& frame, Session& session);
/// Another tool; a stroke that is drawn is dropped, a move that is under way is done.
void choose_tool(Tool tool, Session& session);
/// Drops what is being drawn; a move that is under way is taken back. Whether there was any.
bool cancel_stroke(Session& session);
/// Edits by keys and buttons; each says what it did and asks for the picture.
void show_edit(std::size_t changed, Session& session);
void undo_edit(Session& session);
void redo_edit(Session& session);
/// Where the gizmo stands: the middle of what is selected, else of all; none where no tool has it.
std::optional<Gizmo> gizmo_of(const Session& session);
/// World radius of the sphere that is drawn.
double drawn_radius(const Session& session, const Camera& camera);

}  // namespace darb
