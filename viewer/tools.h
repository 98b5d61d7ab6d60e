// SPDX-License-Identifier: MIT
// Tools: what the left button does to the splats while a tool is chosen. A stroke selects, a gizmo
// moves, turns and scales the selection, and clicks measure.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/edit.h"
#include "engine/scene/edit_splats.h"

namespace darb {

enum class GizmoMode { move, turn, scale };

/// Where the gizmo is and how large, px from its centre to the end of an axis or to a ring.
struct Gizmo {
    GizmoMode mode = GizmoMode::move;
    glm::dvec3 centre{0.0};  // world
    double size_px = 90;
};

/// Lines of one handle in the world, axis 0 to 2. Scaling has one handle, 0, a circle that faces
/// the camera.
std::vector<glm::dvec3> handle_lines(const Gizmo& gizmo, const Camera& camera, int axis);
/// The nearest handle within a ninth of the gizmo's size of a pixel; nothing where there is none.
std::optional<int> handle_at(const Gizmo& gizmo, const Camera& camera, const glm::dvec2& px);
/// The move that dragging the handle from one pixel to another asks for. It is the identity where
/// the drag has no meaning (along an axis that points at the eye).
Similarity dragged(const Gizmo& gizmo, const Camera& camera, int handle, const glm::dvec2& from,
                   const glm::dvec2& to);
/// A similarity that leaves `centre` where it is, followed by a shift.
Similarity about(const glm::dvec3& centre, double scale, const glm::dmat3& turn,
                 const glm::dvec3& shift = glm::dvec3(0.0));

struct Session;
struct Input;
struct ControlFrame;

/// In the order of their keys (input.h).
enum class Tool {
    navigate,
    rectangle,
    lasso,
    brush,
    sphere,
    move,
    turn,
    scale,
    measure,
    polygon,
    flood
};

/// How often values occur, for the ranges that one drags.
struct ValueHistograms {
    static constexpr std::size_t kBins = 64;
    int version = -1;                    // Edit::model_version that was counted
    std::size_t splats = 0;              // of that model
    std::array<float, kBins> opacity{};  // log(1 + count), from 0 to 1
    std::array<float, kBins> size{};     // log(1 + count), from `least` to `most`, in logarithms
    double least = 0, most = 0;          // largest standard deviations, world units
};

struct ToolState {
    Tool tool = Tool::navigate;
    float brush_px = 40;             // radius, px of the window
    std::vector<glm::dvec2> stroke;  // px, while it is being drawn; corners of a polygon
    bool drawing = false;
    // ignores the button until it is let go, because its stroke was cancelled
    bool ignores = false;
    Combine combine = Combine::replace;  // how the stroke selects
    std::optional<glm::dvec3> sphere;    // centre, world
    std::optional<int> handle;           // the gizmo's handle that is dragged
    Gizmo gizmo;
    std::optional<glm::dvec3> centre;  // centre of what a gizmo would move
    int centre_version = -1;           // the edit's version for `centre`
    // The values of selections by value.
    float opacity[2] = {0, 0.1f}, scale[2] = {0, 0.1f};  // scale: world units
    // Those of cleaning up: the least share of the heaviest part, the highest opacity of haze, its
    // least size in times of the median, the least count of photos.
    float isolated = 0.01f, haze_opacity = 0.1f, haze_size = 5;
    int looked_through = 3;
    // Of measuring and of tools that are clicked: where the button went down and whether the
    // pointer has left that place, which measured point it is on, and which side of the measurement
    // has its true length typed.
    std::optional<glm::dvec2> pressed;
    bool pulled = false;
    int held_point = -1, known_side = -1;  // known_side -1: the whole line
    double known_metres = 1;
    ValueHistograms histograms;
    glm::vec3 colour{1.0f};
    float tolerance = 0.1f, grow = 0.01f;  // grow: world units
};

/// Applies the pointer to the splats, where the panels and with them strokes are shown. Returns
/// whether the tool uses the left button.
bool use_tool(const Input& input, const ControlFrame& frame, Session& session);
/// Chooses another tool. A stroke that is being drawn is dropped; a move under way is completed.
void choose_tool(Tool tool, Session& session);
/// Drops the stroke that is being drawn and takes back a move under way. Returns whether there was
/// any.
bool cancel_stroke(Session& session);
/// The measured point within 10 px of the pixel at gui_scale 1; -1: none.
int measured_point_at(const Session& session, const Camera& camera, const glm::dvec2& px);
/// Takes the last corner of the polygon away that is being drawn; without corners it is dropped.
/// Returns whether there was one.
bool drop_corner(Session& session);
/// Whether a corner at this pixel would close the polygon that is being drawn.
bool closes_polygon(const Session& session, const glm::dvec2& px);
/// Steps of measuring: adds a point, or moves one; takes the last away; joins the last to the
/// first; begins anew.
void add_measured_point(const glm::dvec3& point, int replaces, Session& session);
void drop_measured_point(Session& session);
void close_measurement(Session& session);
void clear_measurement(Session& session);
/// A side of the measurement (-1: all of them) has this length, m: then every length is known.
void set_known_length(int side, double metres, Session& session);
/// Makes the measured points lie on level ground.
void set_ground(Session& session);
/// Edits by keys and buttons; each reports what it did and asks for the picture.
void show_edit(std::size_t changed, Session& session);
void undo_edit(Session& session);
void redo_edit(Session& session);
/// Where the gizmo stands: the middle of the selection, else of everything; nothing where the tool
/// has none.
std::optional<Gizmo> gizmo_of(const Session& session);
/// World radius of the sphere that is being drawn.
double drawn_radius(const Session& session, const Camera& camera);

}  // namespace darb
