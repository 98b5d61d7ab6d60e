// Selection by box or sphere, delete, crop, undo, save.
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "viewer/panels/panels.h"

namespace darb {

namespace {

constexpr ImU32 kOutline = IM_COL32(255, 200, 60, 255);
constexpr int kCircleSteps = 64;

// In double: far from the origin a float has no centimetres left.
bool edit_vector(const char* label, glm::dvec3& v, float speed, int components) {
    return ImGui::DragScalarN(label, ImGuiDataType_Double, &v.x, components, speed, nullptr,
                              nullptr, "%.3f");
}

// What of it is before the camera.
void line(const Camera& camera, const glm::dvec3& a, const glm::dvec3& b) {
    glm::dvec3 p = camera.rotation * a + camera.translation;
    glm::dvec3 q = camera.rotation * b + camera.translation;
    constexpr double kNear = 1e-3;
    if (p.z < kNear && q.z < kNear) return;
    glm::dvec3& behind = p.z < q.z ? p : q;
    const glm::dvec3& ahead = p.z < q.z ? q : p;
    if (behind.z < kNear)
        behind = glm::mix(ahead, behind, (ahead.z - kNear) / (ahead.z - behind.z));
    const auto at = [&](const glm::dvec3& v) {
        return ImVec2(static_cast<float>(camera.fx * v.x / v.z + camera.cx),
                      static_cast<float>(camera.fy * v.y / v.z + camera.cy));
    };
    ImGui::GetBackgroundDrawList()->AddLine(at(p), at(q), kOutline, 1.5f);
}

void draw_box(const Camera& camera, const Region& r) {
    for (int corner = 0; corner < 8; ++corner)
        for (int axis = 0; axis < 3; ++axis) {
            if ((corner >> axis & 1) != 0) continue;
            const auto at = [&](int c) {
                return r.centre + r.half_size * glm::dvec3((c & 1) != 0 ? 1 : -1,
                                                           (c & 2) != 0 ? 1 : -1,
                                                           (c & 4) != 0 ? 1 : -1);
            };
            line(camera, at(corner), at(corner | 1 << axis));
        }
}

void draw_sphere(const Camera& camera, const Region& r) {
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < kCircleSteps; ++i) {
            const auto at = [&](int step) {
                const double a = 2 * glm::pi<double>() * step / kCircleSteps;
                glm::dvec3 p(0.0);
                p[(axis + 1) % 3] = std::cos(a);
                p[(axis + 2) % 3] = std::sin(a);
                return r.centre + r.half_size.x * p;
            };
            line(camera, at(i), at(i + 1));
        }
}

void buttons(Session& s) {
    const SplatModel& model = s.scene->model;
    bool changed = false;
    if (ImGui::Button("Delete inside"))
        changed = s.edit.remove(model, s.selection.region, true) > 0;
    tip("splats whose centre is inside, key Delete");
    ImGui::SameLine();
    if (ImGui::Button("Crop to it")) changed = s.edit.remove(model, s.selection.region, false) > 0;
    tip("deletes the splats whose centre is outside");
    ImGui::BeginDisabled(!s.edit.can_undo());
    if (ImGui::Button("Undo")) {
        s.edit.undo();
        changed = true;
    }
    ImGui::EndDisabled();
    tip("Ctrl+Z");
    ImGui::SameLine();
    ImGui::BeginDisabled(!s.edit.can_redo());
    if (ImGui::Button("Redo")) {
        s.edit.redo();
        changed = true;
    }
    ImGui::EndDisabled();
    tip("Ctrl+Y");
    ImGui::SameLine();
    ImGui::Text("%zu deleted", s.edit.removed_count());
    if (changed) s.ask(request::ShowEdits{});
}

}  // namespace

void draw_region(const Session& s, int width, int height) {
    const Camera camera = camera_in_window(s.photos, s.navigation, free_area(s, width, height));
    if (s.selection.region.shape == Region::Shape::box)
        draw_box(camera, s.selection.region);
    else
        draw_sphere(camera, s.selection.region);
}

void edit_panel(Session& s) {
    if (!s.scene || !ImGui::CollapsingHeader("Edit")) return;
    ImGui::Checkbox("show the selection", &s.selection.shown);
    tip("its outline over the picture");
    int shape = s.selection.region.shape == Region::Shape::sphere ? 1 : 0;
    if (ImGui::Combo("shape", &shape, "box\0sphere\0"))
        s.selection.region.shape = shape == 1 ? Region::Shape::sphere : Region::Shape::box;
    tip("along the axes of the file, or round");
    const float speed = static_cast<float>(s.scene->bounds.radius / 200);
    bool moved = edit_vector("centre", s.selection.region.centre, speed, 3);
    tip("x, y, z in units of the scene; drag, or Ctrl+click to type");
    moved |= edit_vector(shape == 1 ? "radius" : "half size", s.selection.region.half_size, speed,
                         shape == 1 ? 1 : 3);
    tip("in units of the scene; drag, or Ctrl+click to type");
    s.selection.region.half_size = glm::max(s.selection.region.half_size, glm::dvec3(1e-6));
    if (ImGui::Button("Centre on the pivot")) {
        s.selection.region.centre = s.navigation.pivot();
        moved = true;
    }
    tip("what the camera turns around");
    if (moved) s.selection.shown = true;
    if (ImGui::Button("Count")) {
        const size_t inside = count_inside(s.scene->model, s.selection.region, s.edit);
        s.note = std::to_string(inside) + " splats are inside";
    }
    tip("how many splats have their centre inside");
    ImGui::SameLine();
    buttons(s);
    path_field("file", s.save_file);
    tip("its ending says in which format");
    ImGui::SameLine();
    if (ImGui::Button("Save")) s.ask(request::Save{});
    tip("the scene as it is edited, Ctrl+S");
    if (ImGui::Button("Save as web page")) s.ask(request::SavePage{});
    tip("an .html beside the file, for any browser");
    ImGui::Checkbox("save upright", &s.save_upright);
    tip("turns what is saved so that up is -y, as most programs want it");
}

}  // namespace darb
