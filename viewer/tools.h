// SPDX-License-Identifier: MIT
// Tools: what the left button does to the splats while one is chosen. A stroke selects, a gizmo
// moves, turns and scales what is selected.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/edit_splats.h"
#include "viewer/edit.h"

namespace darb {

enum class GizmoMode { move, turn, scale };

/// Where it is and how large, px from its centre to the end of an axis or to a ring.
struct Gizmo {
    GizmoMode mode = GizmoMode::move;
    glm::dvec3 centre{0.0};  // world
    double size_px = 90;
};

/// Lines of one handle in the world, axis 0 to 2; of the scale there is one handle, 0, a circle
/// that faces the camera.
std::vector<glm::dvec3> handle_lines(const Gizmo& gizmo, const Camera& camera, int axis);
/// The handle within a ninth of the size of a pixel, the nearest; none where there is none.
std::optional<int> handle_at(const Gizmo& gizmo, const Camera& camera, const glm::dvec2& px);
/// What a drag of the handle from one pixel to another asks for; nothing where that cannot be said
/// (an axis that points at the eye).
Similarity dragged(const Gizmo& gizmo, const Camera& camera, int handle, const glm::dvec2& from,
                   const glm::dvec2& to);
/// A similarity that leaves `centre` where it is, then shifts.
Similarity about(const glm::dvec3& centre, double scale, const glm::dmat3& turn,
                 const glm::dvec3& shift = glm::dvec3(0.0));

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
