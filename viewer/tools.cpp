// SPDX-License-Identifier: MIT
#include "viewer/tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <utility>

#include "engine/core/error.h"
#include "viewer/controls.h"
#include "viewer/session.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr double kHandle = 0.11;  // share of its size: how near a pointer must be to grab a handle
constexpr int kRingSteps = 64;
constexpr double kEdgeOn = 0.05;  // cosine between a view ray and a ring's plane
constexpr double kLeastFactor = 0.01, kMostFactor = 100;

glm::dvec3 axis_of(int axis) {
    glm::dvec3 v(0.0);
    v[axis] = 1;
    return v;
}

// The world units that make up the gizmo's size.
double size_of(const Gizmo& g, const Camera& c) {
    const double depth = (c.rotation * g.centre + c.translation).z;
    return std::max(depth, 1e-6) * g.size_px / c.fx;
}

glm::dvec3 ray_of(const Camera& c, const glm::dvec2& px) {
    const glm::dvec3 d((px.x - c.cx) / c.fx, (px.y - c.cy) / c.fy, 1);
    return glm::normalize(glm::transpose(c.rotation) * d);
}

// How far along an axis from the centre the point nearest to the ray lies.
std::optional<double> along_axis(const Gizmo& g, const Camera& c, int axis, const glm::dvec2& px) {
    const glm::dvec3 a = axis_of(axis), r = ray_of(c, px), w = g.centre - c.centre();
    const double ar = glm::dot(a, r), square = 1 - ar * ar;
    if (square < kEdgeOn * kEdgeOn) return {};
    return (ar * glm::dot(r, w) - glm::dot(a, w)) / square;
}

// The angle on the ring's plane where the ray meets it, else on the screen.
std::optional<double> angle_on_ring(const Gizmo& g, const Camera& c, int axis,
                                    const glm::dvec2& px) {
    const glm::dvec3 n = axis_of(axis), r = ray_of(c, px);
    const double slope = glm::dot(r, n);
    if (std::abs(slope) < kEdgeOn) return {};
    const glm::dvec3 hit = c.centre() + r * (glm::dot(g.centre - c.centre(), n) / slope) - g.centre;
    return std::atan2(hit[(axis + 2) % 3], hit[(axis + 1) % 3]);
}

}  // namespace

std::vector<glm::dvec3> handle_lines(const Gizmo& g, const Camera& c, int axis) {
    const double size = size_of(g, c);
    if (g.mode == GizmoMode::move) return {g.centre, g.centre + size * axis_of(axis)};
    const bool turns = g.mode == GizmoMode::turn;
    if (!turns && axis != 0) return {};
    const glm::dmat3 from_camera = glm::transpose(c.rotation);
    const glm::dvec3 u = turns ? axis_of((axis + 1) % 3) : from_camera[0];
    const glm::dvec3 v = turns ? axis_of((axis + 2) % 3) : from_camera[1];
    std::vector<glm::dvec3> ring;
    for (int i = 0; i <= kRingSteps; ++i) {
        const double angle = 2 * glm::pi<double>() * i / kRingSteps;
        ring.push_back(g.centre + size * (std::cos(angle) * u + std::sin(angle) * v));
    }
    return ring;
}

std::optional<int> handle_at(const Gizmo& g, const Camera& c, const glm::dvec2& px) {
    std::optional<int> best;
    double nearest = kHandle * g.size_px;
    for (int axis = 0; axis < 3; ++axis) {
        const std::vector<glm::dvec3> lines = handle_lines(g, c, axis);
        for (std::size_t i = 1; i < lines.size(); ++i) {
            const auto a = pixel_of(c, lines[i - 1]), b = pixel_of(c, lines[i]);
            if (!a || !b) continue;
            const double distance = distance_to_segment(px, *a, *b);
            if (distance >= nearest) continue;
            nearest = distance;
            best = axis;
        }
    }
    return best;
}

Similarity about(const glm::dvec3& centre, double scale, const glm::dmat3& turn,
                 const glm::dvec3& shift) {
    return {scale, turn, centre + shift - scale * (turn * centre)};
}

Similarity dragged(const Gizmo& g, const Camera& c, int handle, const glm::dvec2& from,
                   const glm::dvec2& to) {
    if (g.mode == GizmoMode::move) {
        const auto a = along_axis(g, c, handle, from), b = along_axis(g, c, handle, to);
        return about(g.centre, 1, glm::dmat3(1.0),
                     a && b ? (*b - *a) * axis_of(handle) : glm::dvec3(0.0));
    }
    if (g.mode == GizmoMode::turn) {
        const auto a = angle_on_ring(g, c, handle, from), b = angle_on_ring(g, c, handle, to);
        if (!a || !b) return {};
        return about(g.centre, 1,
                     glm::dmat3(glm::rotate(glm::dmat4(1.0), *b - *a, axis_of(handle))));
    }
    const auto centre = pixel_of(c, g.centre);
    const double before = centre ? glm::distance(from, *centre) : 0;
    if (!(before > 0)) return {};
    const double factor = glm::distance(to, *centre) / before;
    return about(g.centre, std::clamp(factor, kLeastFactor, kMostFactor), glm::dmat3(1.0));
}

namespace {

Camera camera_of(const Session& s, const ControlFrame& frame) {
    return camera_in_window(s.photos, s.navigation, free_area(s, frame.width, frame.height));
}

bool has_gizmo(Tool tool) {
    return tool == Tool::move || tool == Tool::turn || tool == Tool::scale;
}

Selector stroke_selector(const Session& s, const Camera& camera) {
    const ToolState& t = s.tools;
    switch (t.tool) {
        case Tool::rectangle:
            return by::Rectangle{camera, t.stroke.front(), t.stroke.back()};
        case Tool::lasso:
        case Tool::polygon:
            return by::Polygon{camera, t.stroke};
        case Tool::brush:
            return by::Brush{camera, t.stroke, double{t.brush_px} * s.gui_scale};
        case Tool::sphere:
            if (t.sphere)
                return Region{Region::Shape::sphere, *t.sphere,
                              glm::dvec3(drawn_radius(s, camera))};
            break;
        default:
            break;
    }
    return by::Nothing{};
}

Combine wanted_combine(const Input& in) {
    return in.shift ? Combine::add : in.control ? Combine::subtract : Combine::replace;
}

void begin_stroke(const Input& in, const Camera& camera, Session& s) {
    ToolState& t = s.tools;
    t.drawing = true;
    t.stroke = in.trail;
    if (t.stroke.empty()) t.stroke.emplace_back(in.x, in.y);
    t.combine = wanted_combine(in);
    const glm::dvec2 at = t.stroke.front();
    if (t.tool == Tool::sphere)
        t.sphere = pick(s.scene->model, s.edit.unseen(), camera, at.x, at.y);
}

void end_stroke(const Camera& camera, Session& s) {
    ToolState& t = s.tools;
    const edits::Select select{stroke_selector(s, camera), t.combine};
    t.drawing = false;
    t.stroke.clear();
    t.sphere.reset();
    show_edit(s.edit.perform(select, s.scene->model), s);
}

// The centre is the middle of the selection, else of everything.
void find_centre(Session& s) {
    ToolState& t = s.tools;
    if (t.centre_version == s.edit.version()) return;
    t.centre_version = s.edit.version();
    const SplatSet unseen = s.edit.unseen();
    const bool some = s.edit.selected_count() > 0;
    glm::dvec3 sum(0.0);
    double count = 0;
    for (std::size_t i = 0; i < unseen.size(); ++i)
        if (some ? s.edit.selected()[i] != 0 : unseen[i] == 0) {
            sum += position_of(s.scene->model, i);
            ++count;
        }
    t.centre.reset();
    if (count > 0) t.centre = sum / count;
}

bool use_gizmo(const Input& in, const Camera& camera, Session& s) {
    ToolState& t = s.tools;
    if (!t.drawing) {
        const std::optional<Gizmo> gizmo = gizmo_of(s);
        const glm::dvec2 at = in.trail.empty() ? glm::dvec2(in.x, in.y) : in.trail.front();
        t.handle = gizmo && in.left ? handle_at(*gizmo, camera, at) : std::nullopt;
        if (!t.handle) return false;
        t.gizmo = *gizmo;
        t.stroke = {at};
        t.drawing = true;
        s.edit.begin_transform(s.scene->model);
    }
    if (in.left) {
        if (in.dx == 0 && in.dy == 0) return true;  // the hand rests, or this is only a click
        const Similarity total =
            dragged(t.gizmo, camera, *t.handle, t.stroke.front(), {in.x, in.y});
        s.edit.drag_transform(total, s.scene->model);
        s.ask(request::ShowEdits{});
        return true;
    }
    t.drawing = false;
    t.handle.reset();
    t.stroke.clear();
    show_edit(s.edit.end_transform(s.scene->model), s);
    return true;
}

}  // namespace

namespace {

constexpr double kPull = 4, kNearPoint = 10;  // px at gui_scale 1

/// A click picks a point or takes hold of one, and a drag of a point moves it. A drag beside them
/// belongs to the camera.
bool use_measure(const Input& in, const ControlFrame& frame, const Camera& camera, Session& s) {
    ToolState& t = s.tools;
    const glm::dvec2 at(in.x, in.y);
    if (!t.pressed) {
        if (!in.left || frame.panels_want_mouse || in.shift) return false;
        t.pressed = in.trail.empty() ? at : in.trail.front();
        t.pulled = false;
        t.held_point = measured_point_at(s, camera, *t.pressed);
        t.drawing = true;
    }
    t.pulled |= glm::distance(*t.pressed, at) > kPull * s.gui_scale;
    if (in.left) return t.held_point >= 0 || !t.pulled;
    const int held = t.held_point;
    const bool pulled = t.pulled, closes = held == 0 && !pulled;
    const glm::dvec2 pressed = *t.pressed;
    t.pressed.reset();
    t.drawing = false;
    t.held_point = -1;
    if (closes)
        close_measurement(s);
    else if (held >= 0 && pulled)
        s.ask(request::PickPoint{at, held});
    else if (held < 0 && !pulled)
        s.ask(request::PickPoint{pressed, -1});
    return true;
}

/// Each press sets a corner. One at the first corner, or twice at one place, closes the polygon.
bool use_polygon(const Input& in, const ControlFrame& frame, const Camera& camera, Session& s) {
    ToolState& t = s.tools;
    if (!in.left) t.pressed.reset();
    if (!in.left || t.pressed) return t.drawing || t.pressed;
    if (frame.panels_want_mouse) return false;
    const glm::dvec2 at = in.trail.empty() ? glm::dvec2(in.x, in.y) : in.trail.front();
    t.pressed = at;
    if (!t.drawing) {
        t.stroke.clear();
        t.combine = wanted_combine(in);
        t.drawing = true;
    }
    if (closes_polygon(s, at))
        end_stroke(camera, s);
    else if (t.stroke.empty() || glm::distance(t.stroke.back(), at) >= kNearPoint * s.gui_scale)
        t.stroke.push_back(at);
    return true;
}

/// A click selects; a drag belongs to the camera.
bool use_flood(const Input& in, const ControlFrame& frame, Session& s) {
    ToolState& t = s.tools;
    const glm::dvec2 at(in.x, in.y);
    if (!t.pressed) {
        if (!in.left || frame.panels_want_mouse) return false;
        t.pressed = in.trail.empty() ? at : in.trail.front();
        t.pulled = false;
        t.combine = wanted_combine(in);
        t.drawing = true;
    }
    t.pulled |= glm::distance(*t.pressed, at) > kPull * s.gui_scale;
    if (in.left) return !t.pulled;
    const glm::dvec2 pressed = *t.pressed;
    t.pressed.reset();
    t.drawing = false;
    if (t.pulled) return false;
    s.ask(request::Flood{pressed, t.combine});
    return true;
}

void measure_step(Measurement next, const std::string& what, Session& s) {
    SceneFacts facts = s.edit.facts();
    facts.measured = std::move(next);
    if (s.edit.state(facts, what, false) > 0) s.tools.known_side = -1;
}

}  // namespace

bool drop_corner(Session& s) {
    ToolState& t = s.tools;
    if (t.tool != Tool::polygon || !t.drawing) return false;
    if (!t.stroke.empty()) t.stroke.pop_back();
    t.drawing = !t.stroke.empty();
    return true;
}

bool closes_polygon(const Session& s, const glm::dvec2& px) {
    const ToolState& t = s.tools;
    const double near = kNearPoint * s.gui_scale;
    return t.tool == Tool::polygon && t.drawing && t.stroke.size() >= 3 &&
           (glm::distance(t.stroke.front(), px) < near ||
            glm::distance(t.stroke.back(), px) < near);
}

int measured_point_at(const Session& s, const Camera& camera, const glm::dvec2& px) {
    const std::vector<glm::dvec3>& points = s.edit.facts().measured.points;
    int best = -1;
    double nearest = kNearPoint * s.gui_scale;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const std::optional<glm::dvec2> at = pixel_of(camera, points[i]);
        if (!at || glm::distance(*at, px) >= nearest) continue;
        nearest = glm::distance(*at, px);
        best = static_cast<int>(i);
    }
    return best;
}

void add_measured_point(const glm::dvec3& point, int replaces, Session& s) {
    Measurement next = s.edit.facts().measured;
    const bool moves = replaces >= 0 && replaces < static_cast<int>(next.points.size());
    if (moves) {
        next.points[static_cast<std::size_t>(replaces)] = point;
    } else if (next.closed) {
        next = {{point}, false};  // a closed polygon is complete
    } else {
        next.points.push_back(point);
    }
    measure_step(std::move(next), moves ? "moved a measured point" : "measured a point", s);
}

void drop_measured_point(Session& s) {
    Measurement next = s.edit.facts().measured;
    if (next.points.empty()) return;
    if (!next.closed) next.points.pop_back();
    next.closed = false;
    measure_step(std::move(next), "took a measured point away", s);
}

void close_measurement(Session& s) {
    Measurement next = s.edit.facts().measured;
    if (next.points.size() < 3) return;
    next.closed = true;
    measure_step(std::move(next), "closed the polygon", s);
}

void clear_measurement(Session& s) {
    measure_step({}, "cleared the measurement", s);
}

void set_known_length(int side, double metres, Session& s) {
    const MeasuredLengths lengths = measured_lengths(s.edit.facts().measured, s.navigation.up);
    const bool all = side < 0 || side >= static_cast<int>(lengths.sides.size());
    const double units = all ? lengths.total : lengths.sides[static_cast<std::size_t>(side)];
    SceneFacts facts = s.edit.facts();
    facts.metres_per_unit = metres / units;
    if (!(units > 0) || !std::isfinite(facts.metres_per_unit) || !(facts.metres_per_unit > 0))
        throw Error("scale", "takes a length above 0 and two points that are apart",
                    "Click two points whose distance you know, and type it in metres.");
    show_edit(
        s.edit.state(facts, fmt::format("set the scale: a unit is {:.4g} m", facts.metres_per_unit),
                     true),
        s);
}

void set_ground(Session& s) {
    const std::optional<glm::dvec3> up = up_of_ground(s.edit.facts().measured, s.navigation.up);
    if (!up)
        throw Error("ground", "takes three points or more that are on no line",
                    "Click three points on the ground, far apart.");
    s.edit.note_up(s.navigation.up);
    SceneFacts facts = s.edit.facts();
    facts.up = *up;
    facts.ground = true;
    if (s.edit.state(facts, "set the ground: it is saved level", true) == 0) return;
    leave_photo(s);
    s.navigation.set_up(*up);
    s.navigation.level();
    show_edit(1, s);
}

double drawn_radius(const Session& s, const Camera& camera) {
    const ToolState& t = s.tools;
    if (!t.sphere || t.stroke.empty()) return 0;
    const double depth = (camera.rotation * *t.sphere + camera.translation).z;
    return glm::distance(t.stroke.front(), t.stroke.back()) * depth / camera.fx;
}

std::optional<Gizmo> gizmo_of(const Session& s) {
    const ToolState& t = s.tools;
    if (!s.scene || !has_gizmo(t.tool)) return {};
    Gizmo g = t.gizmo;
    g.mode = t.tool == Tool::move   ? GizmoMode::move
             : t.tool == Tool::turn ? GizmoMode::turn
                                    : GizmoMode::scale;
    g.size_px = 90.0 * s.gui_scale;
    if (t.drawing) return g;
    if (!t.centre) return {};
    g.centre = *t.centre;
    return g;
}

bool use_tool(const Input& in, const ControlFrame& frame, Session& s) {
    ToolState& t = s.tools;
    if (!s.scene || t.tool == Tool::navigate) return false;
    if (!s.panels) cancel_stroke(s);
    const bool ignores = t.ignores && in.left;
    t.ignores = ignores;
    if (!s.panels || ignores) return ignores;
    if (has_gizmo(t.tool) && !t.drawing) find_centre(s);
    const Camera camera = camera_of(s, frame);
    if (t.tool == Tool::polygon) return use_polygon(in, frame, camera, s);
    if (!t.drawing && (frame.panels_want_mouse || !in.left)) return false;
    if (t.tool == Tool::flood) return use_flood(in, frame, s);
    if (t.tool == Tool::measure) return use_measure(in, frame, camera, s);
    if (has_gizmo(t.tool)) return use_gizmo(in, camera, s);
    if (!t.drawing) {
        begin_stroke(in, camera, s);
    } else {
        t.stroke.insert(t.stroke.end(), in.trail.begin(), in.trail.end());
        if (in.left && in.trail.empty()) t.stroke.emplace_back(in.x, in.y);
    }
    if (!in.left) end_stroke(camera, s);
    return true;
}

void choose_tool(Tool tool, Session& s) {
    if (s.edit.transforms() && s.scene) show_edit(s.edit.end_transform(s.scene->model), s);
    s.tools.drawing = false;
    s.tools.stroke.clear();
    s.tools.handle.reset();
    s.tools.pressed.reset();
    s.tools.held_point = -1;
    s.tools.tool = tool;
}

bool cancel_stroke(Session& s) {
    ToolState& t = s.tools;
    if (!t.drawing) return false;
    if (s.edit.transforms() && s.scene) {
        s.edit.cancel_transform(s.scene->model);
        s.ask(request::ShowEdits{});
    }
    choose_tool(t.tool, s);
    t.ignores = true;
    return true;
}

void show_edit(std::size_t changed, Session& s) {
    if (changed == 0) return;
    s.tell(s.edit.last());
    s.ask(request::ShowEdits{});
}

namespace {

void show_step(const std::string& what, const char* said, Session& s) {
    if (what.empty()) return;
    s.tell(said + what);
    s.ask(request::ShowEdits{});
}

// before: the facts' up before a step was undone or redone.
void follow_up(const std::optional<glm::dvec3>& before, Session& s) {
    const std::optional<glm::dvec3>& up = s.edit.facts().up;
    if (!up || up == before) return;
    leave_photo(s);
    s.navigation.set_up(*up);
    s.navigation.level();
}

}  // namespace

void undo_edit(Session& s) {
    if (!s.scene || s.edit.transforms()) return;
    const std::optional<glm::dvec3> up = s.edit.facts().up;
    show_step(s.edit.undo(s.scene->model), "undone: ", s);
    follow_up(up, s);
}

void redo_edit(Session& s) {
    if (!s.scene || s.edit.transforms()) return;
    const std::optional<glm::dvec3> up = s.edit.facts().up;
    show_step(s.edit.redo(s.scene->model), "redone: ", s);
    follow_up(up, s);
}

}  // namespace darb
