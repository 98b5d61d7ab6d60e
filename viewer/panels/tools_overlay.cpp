// Over the picture: the stroke that selects, the gizmo, and toasts that say what happened.
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "viewer/panels/panels.h"
#include "viewer/theme.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr ImU32 kStroke = IM_COL32(255, 200, 60, 255), kStrokeFill = IM_COL32(255, 200, 60, 40);
constexpr ImU32 kAxisColours[3] = {IM_COL32(255, 90, 90, 255), IM_COL32(110, 220, 90, 255),
                                   IM_COL32(90, 150, 255, 255)};
constexpr ImU32 kHeldColour = IM_COL32(255, 225, 80, 255);
constexpr int kToastsShown = 4;
constexpr float kToastGap = 8;  // px at scale 1

ImVec2 point(const glm::dvec2& p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y)};
}

void draw_stroke(const Session& s, const Camera& camera) {
    const ToolState& t = s.tools;
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    if (t.tool == Tool::brush) {
        const float radius = t.brush_px * s.gui_scale;
        for (const glm::dvec2& p : t.stroke) list.AddCircleFilled(point(p), radius, kStrokeFill);
        if (!ImGui::GetIO().WantCaptureMouse)
            list.AddCircle(ImGui::GetIO().MousePos, radius, kStroke, 0, 1.5f);
    }
    if (!t.drawing || t.stroke.empty()) return;
    const ImVec2 first = point(t.stroke.front()), last = point(t.stroke.back());
    if (t.tool == Tool::rectangle) {
        list.AddRectFilled(first, last, kStrokeFill);
        list.AddRect(first, last, kStroke, 0, 0, 1.5f);
    } else if (t.tool == Tool::lasso) {
        for (std::size_t i = 0; i < t.stroke.size(); ++i)
            list.AddLine(point(t.stroke[i]), point(t.stroke[(i + 1) % t.stroke.size()]), kStroke,
                         1.5f);
    } else if (t.tool == Tool::sphere && t.sphere) {
        const std::optional<glm::dvec2> at = pixel_of(camera, *t.sphere);
        if (!at) return;
        const ImVec2 centre = point(*at);
        const auto radius = static_cast<float>(glm::distance(t.stroke.front(), t.stroke.back()));
        list.AddCircleFilled(centre, radius, kStrokeFill, 64);
        list.AddCircle(centre, radius, kStroke, 64, 1.5f);
    }
}

void draw_gizmo(const Session& s, const Camera& camera) {
    const std::optional<Gizmo> gizmo = gizmo_of(s);
    if (!gizmo) return;
    const ImVec2 mouse = ImGui::GetIO().MousePos;
    std::optional<int> held = s.tools.handle;
    if (!s.tools.drawing && !ImGui::GetIO().WantCaptureMouse)
        held = handle_at(*gizmo, camera, {mouse.x, mouse.y});
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<ImVec2> line;
        for (const glm::dvec3& world : handle_lines(*gizmo, camera, axis)) {
            const std::optional<glm::dvec2> at = pixel_of(camera, world);
            if (!at) return;
            line.push_back(point(*at));
        }
        if (line.size() < 2) continue;
        const ImU32 colour = held == axis ? kHeldColour : kAxisColours[axis];
        list.AddPolyline(line.data(), static_cast<int>(line.size()), IM_COL32(0, 0, 0, 150), 0,
                         6 * s.gui_scale);
        list.AddPolyline(line.data(), static_cast<int>(line.size()), colour, 0, 3 * s.gui_scale);
        if (gizmo->mode == GizmoMode::move)
            list.AddCircleFilled(line.back(), 7 * s.gui_scale, colour);
    }
}

}  // namespace

void draw_tools(const Session& s, int width, int height) {
    if (!s.scene || s.tools.tool == Tool::navigate) return;
    const Camera camera = camera_in_window(s.photos, s.navigation, free_area(s, width, height));
    draw_stroke(s, camera);
    draw_gizmo(s, camera);
}

// The latest lowest, in the middle of what the panel leaves free.
void draw_toasts(const Session& s) {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const float gap = kToastGap * s.gui_scale, left = panel_width(s);
    const float wrap = std::max(200.0f, std::min(size.x - left - 4 * gap, 620 * s.gui_scale));
    float bottom = size.y - 4 * gap -
                   (s.progress.load >= 0 || s.progress.exporting >= 0 ? 60 * s.gui_scale : 0);
    ImDrawList& list = *ImGui::GetForegroundDrawList();
    int shown = 0;
    for (auto toast = s.toasts.rbegin(); toast != s.toasts.rend() && shown < kToastsShown;
         ++toast, ++shown) {
        const char* text = toast->text.c_str();
        const ImVec2 box = ImGui::CalcTextSize(text, nullptr, false, wrap);
        const float x = std::round(left + (size.x - left - box.x) / 2);
        const float y = std::round(bottom - box.y - 2 * gap);
        list.AddRectFilled(ImVec2(x - 1.5f * gap, y - gap),
                           ImVec2(x + box.x + 1.5f * gap, y + box.y + gap),
                           IM_COL32(22, 24, 28, 240), 6 * s.gui_scale);
        list.AddRect(ImVec2(x - 1.5f * gap, y - gap),
                     ImVec2(x + box.x + 1.5f * gap, y + box.y + gap), IM_COL32(91, 168, 255, 200),
                     6 * s.gui_scale);
        list.AddText(ImGui::GetFont(), ImGui::GetFontSize(), ImVec2(x, y),
                     IM_COL32(242, 245, 250, 255), text, nullptr, wrap);
        bottom = y - 2 * gap;
    }
}

}  // namespace darb
