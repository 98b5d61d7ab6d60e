#include "viewer/tools.h"

#include <algorithm>

#include "viewer/controls.h"
#include "viewer/session.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

Camera camera_of(const Session& s, const ControlFrame& frame) {
    return camera_in_window(s.photos, s.navigation, free_area(s, frame.width, frame.height));
}

bool has_gizmo(Tool tool) {
    return tool == Tool::move || tool == Tool::turn || tool == Tool::scale;
}

SplatMask stroke_mask(const Session& s, const Camera& camera) {
    const SplatModel& m = s.scene->model;
    const ToolState& t = s.tools;
    switch (t.tool) {
        case Tool::rectangle:
            return in_rectangle(m, camera, t.stroke.front(), t.stroke.back());
        case Tool::lasso:
            return in_lasso(m, camera, t.stroke);
        case Tool::brush:
            return under_brush(m, camera, t.stroke, double{t.brush_px} * s.gui_scale);
        case Tool::sphere:
            if (t.sphere)
                return in_region(
                    m, {Region::Shape::sphere, *t.sphere, glm::dvec3(drawn_radius(s, camera))});
            break;
        default:
            break;
    }
    return SplatMask(m.size(), 0);
}

void begin_stroke(const Input& in, const Camera& camera, Session& s) {
    ToolState& t = s.tools;
    t.drawing = true;
    t.stroke = in.trail;
    if (t.stroke.empty()) t.stroke.emplace_back(in.x, in.y);
    t.combine = in.shift ? Combine::add : in.control ? Combine::subtract : Combine::replace;
    const glm::dvec2 at = t.stroke.front();
    if (t.tool == Tool::sphere)
        t.sphere = pick(s.scene->model, s.edit.unseen(), camera, at.x, at.y);
}

void end_stroke(const Camera& camera, Session& s) {
    ToolState& t = s.tools;
    const SplatMask mask = stroke_mask(s, camera);
    t.drawing = false;
    t.stroke.clear();
    t.sphere.reset();
    show_edit(s.edit.select(mask, t.combine), s);
}

// The middle of what is selected, else of all.
void find_centre(Session& s) {
    ToolState& t = s.tools;
    if (t.centre_version == s.edit.version()) return;
    t.centre_version = s.edit.version();
    const SplatMask unseen = s.edit.unseen();
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
        if (in.dx == 0 && in.dy == 0) return true;  // a hand that rests, or a click alone
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
    if (!t.drawing && (frame.panels_want_mouse || !in.left)) return false;
    const Camera camera = camera_of(s, frame);
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

}  // namespace

void undo_edit(Session& s) {
    if (!s.scene || s.edit.transforms()) return;
    show_step(s.edit.undo(s.scene->model), "undone: ", s);
}

void redo_edit(Session& s) {
    if (!s.scene || s.edit.transforms()) return;
    show_step(s.edit.redo(s.scene->model), "redone: ", s);
}

}  // namespace darb
