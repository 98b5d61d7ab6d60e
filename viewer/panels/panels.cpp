// SPDX-License-Identifier: MIT
// The side panel as a whole, and what is drawn over the picture: progress, errors, help.
#include "viewer/panels/panels.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "viewer/gui.h"

namespace darb {

namespace {

constexpr float kWidth = 340;  // px at scale 1
constexpr float kMargin = 8;   // px
// share of the width: the room beside the panel is used alone only if it has this much
constexpr double kLeastFree = 0.4;

void progress_window(Session& s, float width, float height) {
    const WorkProgress& p = s.progress;
    if (std::max({p.load, p.exporting, p.measuring, p.searching, p.mesh}) < 0) return;
    ImGui::SetNextWindowPos(ImVec2(width / 2, height - 20), 0, ImVec2(0.5f, 1));
    ImGui::Begin("progress", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize);
    const bool loads = p.load >= 0;
    const auto [text, share] =
        loads              ? std::pair(p.load_stage.c_str(), p.load)
        : p.exporting >= 0 ? std::pair("exporting frames", p.exporting)
        : p.measuring >= 0 ? std::pair("measuring settings and effects", p.measuring)
        : p.searching >= 0 ? std::pair("looking for splats in free space", p.searching)
                           : std::pair(p.mesh_stage.c_str(), p.mesh);
    ImGui::TextUnformatted(text);
    ImGui::ProgressBar(static_cast<float>(share), ImVec2(kWidth * s.gui_scale, 0));
    ImGui::SameLine();
    if (ImGui::Button("Cancel"))
        s.ask(loads ? Request(request::CancelLoad{}) : Request(request::CancelWork{}));
    tip("Esc");
    ImGui::End();
}

void error_window(Session& s, float width, float height) {
    if (s.error.empty()) return;
    ImGui::SetNextWindowPos(ImVec2(width / 2, height / 2), 0, ImVec2(0.5f, 0.5f));
    const auto& [r, g, b, alpha] = theme::kError;
    const ImVec4 error_ground(r, g, b, alpha);
    ImGui::PushStyleColor(ImGuiCol_TitleBgActive, error_ground);
    ImGui::PushStyleColor(ImGuiCol_TitleBg, error_ground);
    ImGui::Begin("That did not work", nullptr,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
    ImGui::PopStyleColor(2);
    ImGui::PushTextWrapPos(500 * s.gui_scale);
    ImGui::TextUnformatted(s.error.c_str());
    if (s.scene) ImGui::TextDisabled("The previous scene is still open.");
    ImGui::PopTextWrapPos();
    if (ImGui::Button("Close")) s.error.clear();
    tip("Esc");
    ImGui::End();
}

void leaving_window(Session& s, float width, float height) {
    if (!s.leaving) return;
    ImGui::SetNextWindowPos(ImVec2(width / 2, height / 2), 0, ImVec2(0.5f, 0.5f));
    ImGui::Begin("Not saved", nullptr,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
    if (unsaved_edits(s)) {
        ImGui::TextUnformatted("The edits of this scene have not been saved.");
        if (keeps_project(s)) {
            path_field("project", s.project.to_save);
            tip("Keeps the layers with all edits");
        } else {
            path_field("file", s.save_file);
            tip("The ending of the name decides the format");
        }
    }
    if (unsaved_mesh(s)) {
        ImGui::TextUnformatted("The mesh that was made has not been saved.");
        path_field("mesh file", s.mesh_file);
        tip("The ending of the name decides the format");
    }
    const bool quit = s.leaving->quit;
    if (ImGui::Button(quit ? "Save and quit" : "Save and open")) s.ask(request::SaveAndLeave{});
    tip("Save to the files above first");
    ImGui::SameLine();
    if (ImGui::Button(quit ? "Quit" : "Open")) s.ask(request::Leave{});
    tip("What is not saved is lost");
    ImGui::SameLine();
    if (ImGui::Button("Stay")) s.ask(request::Stay{});
    tip("Esc");
    ImGui::End();
}

void empty_hint(const Session& s, float width, float height) {
    if (s.scene || s.training.live || s.progress.load >= 0) return;
    const char* text = "Drop a splat file here, or press Ctrl+O";
    const ImVec2 size = ImGui::CalcTextSize(text);
    ImGui::GetBackgroundDrawList()->AddText(ImVec2((width - size.x) / 2, (height - size.y) / 2),
                                            IM_COL32(220, 222, 226, 255), text);
}

void side_panel(Session& s, float height) {
    ImGui::SetNextWindowPos(ImVec2(kMargin, kMargin), ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSizeConstraints(ImVec2(kWidth * s.gui_scale, 0),
                                        ImVec2(kWidth * s.gui_scale, height - 2 * kMargin));
    ImGui::Begin("darb", nullptr, ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::PushItemWidth(150 * s.gui_scale);
    scene_panel(s);
    outliner(s);
    training_panel(s);
    display_panel(s);
    camera_panel(s);
    performance_panel(s);
    accuracy_panel(s);
    effects_panel(s);
    mesh_panel(s);
    measure_panel(s);
    notes_panel(s);
    edit_panel(s);
    path_panel(s);
    if (ImGui::Button("Keys and mouse (?)")) s.help = !s.help;
    tip("all keys, key ?");
    if (!s.note.empty()) {
        ImGui::Separator();
        ImGui::TextWrapped("%s", s.note.c_str());
    }
    ImGui::PopItemWidth();
    ImGui::End();
}

}  // namespace

void path_field(const char* label, std::filesystem::path& path) {
    char text[1024];
    const std::string now = path.string();
    std::strncpy(text, now.c_str(), sizeof text - 1);
    text[sizeof text - 1] = '\0';
    if (ImGui::InputText(label, text, sizeof text)) path = text;
}

void tip(const char* text) {
    if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(ImGui::GetFontSize() * 22);
    ImGui::TextUnformatted(text);
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
}

void draw_panels(Session& s) {
    const auto [width, height] = ImGui::GetIO().DisplaySize;
    empty_hint(s, width, height);
    draw_panes(s);
    if (s.panels) {
        draw_measurement(s, static_cast<int>(width), static_cast<int>(height));
        draw_notes(s, static_cast<int>(width), static_cast<int>(height));
        draw_tools(s, static_cast<int>(width), static_cast<int>(height));
        if (s.selection.shown) draw_region(s, static_cast<int>(width), static_cast<int>(height));
        side_panel(s, height);
    }
    progress_window(s, width, height);
    open_window(s);
    help_window(s);
    leaving_window(s, width, height);
    error_window(s, width, height);
    if (s.panels) draw_toasts(s);
}

float panel_width(const Session& s) {
    return s.panels ? kWidth * s.gui_scale + 2 * kMargin : 0;
}

WindowArea free_area(const Session& s, int width, int height) {
    const int left = static_cast<int>(std::lround(panel_width(s)));
    return {width, height, width - left >= kLeastFree * width ? left : 0};
}

}  // namespace darb
