// The side panel as a whole, and what is drawn over the picture: progress, errors, help.
#include "viewer/panels/panels.h"

#include <imgui.h>

#include <cstring>

namespace darb {

namespace {

constexpr float kWidth = 330;  // px at scale 1
constexpr float kMargin = 8;   // px

void progress_window(Session& s, float width, float height) {
    const WorkProgress& p = s.progress;
    if (p.load < 0 && p.exporting < 0 && p.measuring < 0) return;
    ImGui::SetNextWindowPos(ImVec2(width / 2, height - 20), 0, ImVec2(0.5f, 1));
    ImGui::Begin("progress", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize);
    const bool loads = p.load >= 0;
    const bool exports = p.exporting >= 0;
    ImGui::TextUnformatted(loads     ? p.load_stage.c_str()
                           : exports ? "exporting frames"
                                     : "measuring settings and effects");
    ImGui::ProgressBar(static_cast<float>(loads     ? p.load
                                          : exports ? p.exporting
                                                    : p.measuring),
                       ImVec2(kWidth * s.gui_scale, 0));
    ImGui::SameLine();
    if (ImGui::Button("Cancel"))
        s.ask(loads ? Request(request::CancelLoad{}) : Request(request::CancelWork{}));
    ImGui::End();
}

void error_window(Session& s, float width, float height) {
    if (s.error.empty()) return;
    ImGui::SetNextWindowPos(ImVec2(width / 2, height / 2), 0, ImVec2(0.5f, 0.5f));
    ImGui::PushStyleColor(ImGuiCol_TitleBgActive, ImVec4(0.6f, 0.1f, 0.1f, 1));
    ImGui::PushStyleColor(ImGuiCol_TitleBg, ImVec4(0.6f, 0.1f, 0.1f, 1));
    ImGui::Begin("That did not work", nullptr,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
    ImGui::PopStyleColor(2);
    ImGui::PushTextWrapPos(500 * s.gui_scale);
    ImGui::TextUnformatted(s.error.c_str());
    if (s.scene) ImGui::TextDisabled("The scene before is still there.");
    ImGui::PopTextWrapPos();
    if (ImGui::Button("Close")) s.error.clear();
    ImGui::End();
}

void leaving_window(Session& s, float width, float height) {
    if (!s.leaving) return;
    ImGui::SetNextWindowPos(ImVec2(width / 2, height / 2), 0, ImVec2(0.5f, 0.5f));
    ImGui::Begin("Not saved", nullptr,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
    ImGui::Text("%zu splats are deleted and not saved.", s.edit.removed_count());
    path_field("file", s.save_file);
    const bool quit = s.leaving->quit;
    if (ImGui::Button(quit ? "Save and quit" : "Save and open")) s.ask(request::SaveAndLeave{});
    ImGui::SameLine();
    if (ImGui::Button(quit ? "Quit" : "Open")) s.ask(request::Leave{});
    ImGui::SameLine();
    if (ImGui::Button("Stay (Esc)")) s.ask(request::Stay{});
    ImGui::End();
}

void help(const Session& s) {
    if (!ImGui::CollapsingHeader("Keys and mouse")) return;
    ImGui::TextUnformatted(
        "left drag          orbit\n"
        "right drag         look around\n"
        "middle, Shift+left pan\n"
        "wheel              zoom (flying: speed)\n"
        "double click       orbit around this\n"
        "W A S D Q E        fly\n"
        "F  L               frame all, level\n"
        "[  ]               camera of the data set\n"
        "K  space           add key frame, play\n"
        "space  .           training: pause, step\n"
        "Delete             delete the selection\n"
        "Ctrl+Z Y S Q       undo, redo, save, quit\n"
        "P  H  F11          picture, panels, full screen\n"
        "Esc                stop, cancel, leave full screen");
    ImGui::TextDisabled("Drop a file to open it. %s", s.device_name.c_str());
}

void empty_hint(const Session& s, float width, float height) {
    if (s.scene || s.training.live || s.progress.load >= 0) return;
    const char* text = "Drop a splat file here";
    const ImVec2 size = ImGui::CalcTextSize(text);
    ImGui::GetBackgroundDrawList()->AddText(ImVec2((width - size.x) / 2, (height - size.y) / 2),
                                            IM_COL32(200, 200, 200, 255), text);
}

void side_panel(Session& s, float height) {
    ImGui::SetNextWindowPos(ImVec2(kMargin, kMargin), ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSizeConstraints(ImVec2(kWidth * s.gui_scale, 0),
                                        ImVec2(kWidth * s.gui_scale, height - 2 * kMargin));
    ImGui::Begin("darb", nullptr, ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::PushItemWidth(150 * s.gui_scale);
    scene_panel(s);
    training_panel(s);
    display_panel(s);
    camera_panel(s);
    performance_panel(s);
    accuracy_panel(s);
    effects_panel(s);
    edit_panel(s);
    path_panel(s);
    help(s);
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

void draw_panels(Session& s) {
    const auto [width, height] = ImGui::GetIO().DisplaySize;
    empty_hint(s, width, height);
    draw_panes(s);
    if (s.panels) {
        if (s.selection.shown) draw_region(s, static_cast<int>(width), static_cast<int>(height));
        side_panel(s, height);
    }
    progress_window(s, width, height);
    leaving_window(s, width, height);
    error_window(s, width, height);
}

float panel_width(const Session& s) {
    return s.panels ? kWidth * s.gui_scale + 2 * kMargin : 0;
}

}  // namespace darb
