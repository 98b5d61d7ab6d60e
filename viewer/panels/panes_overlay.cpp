// Pictures side by side: the choice of kernels, the lines between panes, and what each pane shows.
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/kernels/kernel_registry.h"
#include "viewer/panels/panels.h"

namespace darb {

namespace {

constexpr float kGrip = 12;     // px at scale 1, where a line can be taken
constexpr float kLabelGap = 8;  // px
constexpr ImU32 kLine = IM_COL32(255, 255, 255, 230), kEdge = IM_COL32(0, 0, 0, 160);
constexpr ImU32 kLabelBack = IM_COL32(16, 18, 22, 215), kLabel = IM_COL32(240, 240, 240, 255);

std::vector<std::string> pane_names(const Session& s) {
    std::vector<std::string> names;
    if (photo_beside(s.photos, s.display)) names.emplace_back("photo");
    names.emplace_back(kernel_name(s.display.kernel));
    for (const int kernel : kernels_beside(s.panes, s.display.kernel))
        names.emplace_back(kernel_name(kernel));
    return names;
}

std::string pane_label(const Session& s, const std::vector<std::string>& names, size_t pane) {
    std::string text = names[pane];
    if (pane == 0) return text;
    if (s.panes.difference) text += ", error";
    if (pane > s.panes.psnr_db.size() || s.display.mode != VIEW_COLOUR) return text;
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

// From its strip's left edge, right of the panel, in the first row that is free there; none where
// the strip is hidden. ends: px, where the labels of each row end.
void draw_label(const Session& s, const std::string& text, float left, float right,
                std::vector<float>& ends) {
    const float gap = kLabelGap * s.gui_scale, window = ImGui::GetIO().DisplaySize.x;
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    const float begin = std::max(left, panel_width(s));
    if (begin + gap > right) return;
    const float x = std::min(begin, window - size.x - 2 * gap) + gap;
    const auto free = std::find_if(ends.begin(), ends.end(), [&](float end) { return end <= x; });
    const float y = gap + float(free - ends.begin()) * (size.y + 2 * gap);
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
    tip("up to three more kernels, each in a strip of the picture; drag the lines between them");
    if (s.panes.lines.empty()) return;
    ImGui::Checkbox("error to the leftmost", &s.panes.difference);
    tip("all strips but the leftmost show their difference to it, as heat");
    if (s.panes.difference) {
        ImGui::SliderFloat("error hottest at", &s.panes.difference_max, 0.005f, 1.0f,
                           "%.3f of white", kLogarithmic);
        tip("mean absolute difference of the three channels");
    }
    const std::vector<std::string> names = pane_names(s);
    for (size_t i = 0; i < s.panes.psnr_db.size() && i + 1 < names.size(); ++i)
        ImGui::TextUnformatted(pane_label(s, names, i + 1).c_str());
}

}  // namespace darb
