// SPDX-License-Identifier: MIT
// Pictures side by side: the choice of kernels, the lines between panes, and a label for each pane.
#include <imgui.h>
#include <algorithm>
#include <cmath>
#include <string>

#include "engine/kernels/kernel_registry.h"
#include "viewer/gui.h"
#include "viewer/panels/panels.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr float kGrip = 12;     // px at scale 1; how near to a line it can be grabbed
constexpr float kLabelGap = 8;  // px
constexpr ImU32 kLine = IM_COL32(255, 255, 255, 230), kEdge = IM_COL32(0, 0, 0, 160);
constexpr ImU32 kLabelBack = IM_COL32(16, 18, 22, 215), kLabel = IM_COL32(240, 240, 240, 255);

std::vector<std::string> pane_names(const Session& s) {
    std::vector<std::string> names;
    if (photo_beside(s.photos, s.display)) names.emplace_back("photo");
    names.emplace_back(kernel_name(s.display.kernel));
    for (const int kernel : kernels_beside(s.panes, s.display.kernel))
        names.emplace_back(kernel_name(kernel));
    if (s.mesh && s.display.mesh == MeshShow::beside) names.emplace_back("mesh");
    return names;
}

std::string pane_label(const Session& s, const std::vector<std::string>& names, size_t pane) {
    std::string text = names[pane];
    if (pane == 0) return text;
    if (s.panes.difference) text += ", error";
    const bool is_mesh = s.mesh && s.display.mesh == MeshShow::beside && pane + 1 == names.size();
    if (pane > s.panes.psnr_db.size() || s.display.mode != VIEW_COLOUR || is_mesh) return text;
    const double db = s.panes.psnr_db[pane - 1];
    if (std::isnan(db)) return text;
    char number[32];
    std::snprintf(number, sizeof number, std::isinf(db) ? ": equal to " : ": %.1f dB to ", db);
    return text + number + names[0];
}

void drag_line(Session& s, size_t line, const ImVec2& size) {
    const float grip = kGrip * s.gui_scale;
    ImGui::SetNextWindowPos(ImVec2(s.panes.lines[line] * size.x - grip / 2, 0));
    ImGui::SetNextWindowSize(ImVec2(grip, size.y));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1, 1));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
    ImGui::Begin(("line " + std::to_string(line)).c_str(), nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoBackground |
                     ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoNav |
                     ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::InvisibleButton("grip", ImVec2(grip, size.y));
    if (ImGui::IsItemActive()) move_line(line, ImGui::GetIO().MousePos.x / size.x, s.panes);
    if (ImGui::IsItemHovered() || ImGui::IsItemActive())
        ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    ImGui::End();
    ImGui::PopStyleVar(3);
}

void draw_line(const Session& s, float share, const ImVec2& size) {
    const float x = std::round(share * size.x), y = size.y / 2, unit = s.gui_scale;
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddLine(ImVec2(x, 0), ImVec2(x, size.y), kEdge, 4 * unit);
    list.AddLine(ImVec2(x, 0), ImVec2(x, size.y), kLine, 2 * unit);
    list.AddCircleFilled(ImVec2(x, y), 11 * unit, kEdge);
    list.AddCircleFilled(ImVec2(x, y), 9 * unit, kLine);
    for (const float side : {-1.0f, 1.0f})
        list.AddTriangleFilled(
            ImVec2(x + side * 6 * unit, y), ImVec2(x + side * 2 * unit, y - 4 * unit),
            ImVec2(x + side * 2 * unit, y + 4 * unit), IM_COL32(40, 40, 40, 255));
}

// Draws a label at the strip's left edge, right of the panel, in the first row that is free there;
// draws none where the strip is hidden. ends: the px at which the labels of each row end.
void draw_label(const Session& s, const std::string& text, float left, float right,
                std::vector<float>& ends) {
    const float gap = kLabelGap * s.gui_scale, window = ImGui::GetIO().DisplaySize.x;
    const float size_y = ImGui::GetIO().DisplaySize.y;
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    const WindowArea area = free_area(s, static_cast<int>(window), static_cast<int>(size_y));
    const float begin = std::max(left, static_cast<float>(area.left));
    const float whole = window - static_cast<float>(area.right);
    if (begin + gap > std::min(right, whole)) return;
    // The axes lie in the same corner: a label that would reach them stands below.
    const float axes = axes_side(s, area), row_height = size.y + 2 * gap;
    const bool below = axes > 0 && begin + size.x + 2 * gap > whole - axes;
    const auto first = below ? static_cast<std::size_t>(std::ceil(axes / row_height)) : 0;
    if (ends.size() < first) ends.resize(first, 0);
    const float x = std::min(begin, whole - size.x - 2 * gap) + gap;
    const auto free = std::find_if(ends.begin() + std::ptrdiff_t(first), ends.end(),
                                   [&](float row_end) { return row_end <= x; });
    const float y = static_cast<float>(area.top) + gap + float(free - ends.begin()) * row_height;
    if (free == ends.end())
        ends.push_back(x + size.x + gap);
    else
        *free = x + size.x + gap;
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddRectFilled(ImVec2(x - gap / 2, y), ImVec2(x + size.x + gap / 2, y + gap + size.y),
                       kLabelBack, 4 * s.gui_scale);
    list.AddText(ImVec2(x, y + gap / 2), kLabel, text.c_str());
}

}  // namespace

void draw_panes(Session& s) {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const std::vector<std::string> names = pane_names(s);
    if (s.panes.lines.empty() || names.size() != s.panes.lines.size() + 1) return;
    for (size_t i = 0; i < s.panes.lines.size(); ++i) drag_line(s, i, size);
    if (!s.panels) return;
    for (const float line : s.panes.lines) draw_line(s, line, size);
    std::vector<float> ends;
    for (size_t i = 0; i < names.size(); ++i) {
        const float left = i == 0 ? 0 : s.panes.lines[i - 1] * size.x;
        const float right = i + 1 == names.size() ? size.x : s.panes.lines[i] * size.x;
        draw_label(s, pane_label(s, names, i), left, right, ends);
    }
}

void panes_panel(Session& s) {
    std::vector<int>& beside = s.panes.kernels;
    const std::size_t count = kernels_beside(s.panes, s.display.kernel).size();
    const std::string now = count == 0 ? "none" : std::to_string(count) + " more";
    if (ImGui::BeginCombo("side by side", now.c_str())) {
        for (const int k : known_kernels()) {
            if (k == s.display.kernel) continue;
            const auto at = std::find(beside.begin(), beside.end(), k);
            const std::string name(kernel_name(k));
            const bool full = at == beside.end() && beside.size() >= kMostBeside;
            const ImGuiSelectableFlags flags =
                ImGuiSelectableFlags_DontClosePopups |
                (full ? ImGuiSelectableFlags_Disabled : ImGuiSelectableFlags_None);
            if (!ImGui::Selectable(name.c_str(), at != beside.end(), flags)) continue;
            if (at != beside.end())
                beside.erase(at);
            else
                beside.push_back(k);
        }
        ImGui::EndCombo();
    }
    tip("Show up to three more kernels, each in a strip of the picture; drag the lines between "
        "them");
    if (s.panes.lines.empty()) return;
    ImGui::Checkbox("error against the leftmost", &s.panes.difference);
    tip("Show how all other strips differ from the leftmost, as heat");
    if (s.panes.difference) {
        slider("error hottest at", &s.panes.difference_max, 0.005f, 1.0f, "%.3f of white",
               kLogarithmic);
        tip("The mean absolute difference of the three channels that gets the hottest colour");
    }
    const std::vector<std::string> names = pane_names(s);
    for (size_t i = 0; i < s.panes.psnr_db.size() && i + 1 < names.size(); ++i)
        if (const std::string label = pane_label(s, names, i + 1); label != names[i + 1])
            ImGui::TextUnformatted(label.c_str());
}

// What lies over the picture: the stroke that selects, the gizmo, and toasts that report what
// happened.

namespace {

constexpr ImU32 kStroke = IM_COL32(255, 200, 60, 255), kStrokeFill = IM_COL32(255, 200, 60, 40);
constexpr ImU32 kHeldColour = IM_COL32(255, 225, 80, 255);
constexpr int kToastsShown = 4;
constexpr float kToastGap = 8;  // px at scale 1

ImVec2 point(const glm::dvec2& p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y)};
}

void circle(ImDrawList& list, const ImVec2& centre, float radius, float scale) {
    list.AddCircle(centre, radius, IM_COL32(0, 0, 0, 190), 0, 1.5f * scale + 2);
    list.AddCircle(centre, radius, kStroke, 0, 1.5f * scale);
}

void draw_stroke(const Session& s, const Camera& camera) {
    const ToolState& t = s.tools;
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    if (t.tool == Tool::brush) {
        const float radius = t.brush_px * s.gui_scale;
        for (const glm::dvec2& p : t.stroke) list.AddCircleFilled(point(p), radius, kStrokeFill);
        if (!ImGui::GetIO().WantCaptureMouse)
            circle(list, ImGui::GetIO().MousePos, radius, s.gui_scale);
    }
    if (!t.drawing || t.stroke.empty()) return;
    const ImVec2 first = point(t.stroke.front()), last = point(t.stroke.back());
    if (t.tool == Tool::rectangle) {
        list.AddRectFilled(first, last, kStrokeFill);
        const ImVec2 corners[] = {first, ImVec2(last.x, first.y), last, ImVec2(first.x, last.y)};
        outlined(list, corners, kStroke, 1.5f * s.gui_scale, true);
    } else if (t.tool == Tool::lasso) {
        std::vector<ImVec2> line;
        for (const glm::dvec2& p : t.stroke) line.push_back(point(p));
        outlined(list, line, kStroke, 1.5f * s.gui_scale, true);
    } else if (t.tool == Tool::polygon) {
        const ImVec2 mouse = ImGui::GetIO().MousePos;
        std::vector<ImVec2> corners;
        for (const glm::dvec2& p : t.stroke) corners.push_back(point(p));
        const bool closes = closes_polygon(s, {mouse.x, mouse.y});
        corners.push_back(closes ? corners.front() : mouse);
        outlined(list, corners, kStroke, 1.5f * s.gui_scale);
        for (const glm::dvec2& p : t.stroke)
            list.AddCircleFilled(point(p), 3 * s.gui_scale, kStroke);
        circle(list, first, (closes ? 8.0f : 5.0f) * s.gui_scale, s.gui_scale);
    } else if (t.tool == Tool::sphere && t.sphere) {
        const std::optional<glm::dvec2> at = pixel_of(camera, *t.sphere);
        if (!at) return;
        const ImVec2 centre = point(*at);
        const auto radius = static_cast<float>(glm::distance(t.stroke.front(), t.stroke.back()));
        list.AddCircleFilled(centre, radius, kStrokeFill, 64);
        circle(list, centre, radius, s.gui_scale);
    }
}

// The head of an arrow; a disc where it points at the eye.
void draw_head(ImDrawList& list, const ImVec2& from, const ImVec2& to, ImU32 colour, float scale) {
    const float dx = to.x - from.x, dy = to.y - from.y, length = std::hypot(dx, dy);
    if (length < 20 * scale) return list.AddCircleFilled(to, 7 * scale, colour);
    const float ux = dx / length * scale, uy = dy / length * scale;
    list.AddTriangleFilled(ImVec2(to.x + 8 * ux, to.y + 8 * uy),
                           ImVec2(to.x - 8 * ux - 7 * uy, to.y - 8 * uy + 7 * ux),
                           ImVec2(to.x - 8 * ux + 7 * uy, to.y - 8 * uy - 7 * ux), colour);
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
        const ImU32 colour = held == axis ? kHeldColour : axis_colour(axis);
        list.AddPolyline(line.data(), static_cast<int>(line.size()), IM_COL32(0, 0, 0, 150), 0,
                         6 * s.gui_scale);
        list.AddPolyline(line.data(), static_cast<int>(line.size()), colour, 0,
                         (held == axis ? 5.0f : 3.0f) * s.gui_scale);
        if (gizmo->mode == GizmoMode::move) draw_head(list, line[0], line[1], colour, s.gui_scale);
    }
}

}  // namespace

void draw_tools(const Session& s, int width, int height) {
    if (!s.scene || s.tools.tool == Tool::navigate) return;
    const Camera camera = camera_in_window(s.photos, s.navigation, free_area(s, width, height));
    draw_stroke(s, camera);
    draw_gizmo(s, camera);
}

// The latest message is the lowest, in the middle of the free area.
void draw_toasts(const Session& s) {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const WindowArea area = free_area(s, static_cast<int>(size.x), static_cast<int>(size.y));
    const float gap = kToastGap * s.gui_scale, left = static_cast<float>(area.left);
    const float free = static_cast<float>(area.free_width());
    const float wrap = std::max(200.0f, std::min(free - 4 * gap, 620 * s.gui_scale));
    float bottom =
        size.y - 4 * gap -
        (std::max({s.progress.load, s.progress.exporting, s.progress.mesh}) >= 0 ? 60 * s.gui_scale
                                                                                 : 0);
    ImDrawList& list = *ImGui::GetForegroundDrawList();
    int shown = 0;
    for (auto toast = s.toasts.rbegin(); toast != s.toasts.rend() && shown < kToastsShown;
         ++toast, ++shown) {
        const char* text = toast->text.c_str();
        const ImVec2 box = ImGui::CalcTextSize(text, nullptr, false, wrap);
        const float x = std::round(left + (free - box.x) / 2);
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
