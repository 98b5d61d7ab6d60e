// SPDX-License-Identifier: MIT
// The panels as a whole: where menus, toolbar, outliner and properties are docked, and what is
// drawn over the picture: progress, errors, questions.
#include "viewer/panels/panels.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "viewer/gui.h"

namespace darb {

namespace {

// px at scale 1
constexpr float kMenu = 23, kSide = 350, kProgress = 340;
constexpr float kOutlinerShare = 0.22f;  // of the height of the side
constexpr float kLeastOutliner = 92, kMostOutliner = 220;
// share of the width: panels leave that much to the picture, or else cover it
constexpr double kLeastFree = 0.4;
constexpr float kMostSide = 0.6f;  // share of the width
constexpr float kLeastHeight = 4;  // menus that are high

constexpr ImGuiWindowFlags kDocked =
    ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
    ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoSavedSettings;

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
    ImGui::ProgressBar(static_cast<float>(share), ImVec2(kProgress * s.gui_scale, 0));
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
    ImGui::Begin(s.train_form.runs ? "A run goes on###leaving" : "Not saved###leaving", nullptr,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
    if (unsaved_edits(s)) {
        ImGui::TextUnformatted("The edits of this scene have not been saved.");
        if (keeps_project(s)) {
            path_field("project", s.project.to_save, "Keeps the layers with all edits");
        } else {
            path_field("file", s.save_file, "The ending of the name decides the format");
        }
    }
    if (unsaved_mesh(s)) {
        ImGui::TextUnformatted("The mesh that was made has not been saved.");
        path_field("mesh file", s.mesh_file, "The ending of the name decides the format");
    }
    const bool quit = s.leaving->quit, saves = unsaved_edits(s) || unsaved_mesh(s);
    if (s.train_form.runs) {
        ImGui::PushTextWrapPos(460 * s.gui_scale);
        ImGui::TextUnformatted(
            "A training run goes on in this window, and would end with it. It saves its scene and "
            "a checkpoint first, from which darb train --resume goes on.");
        ImGui::PopTextWrapPos();
    }
    if (saves) {
        if (ImGui::Button(quit ? "Save and quit" : "Save and open")) s.ask(request::SaveAndLeave{});
        tip("Save to the files above first");
        ImGui::SameLine();
    }
    if (ImGui::Button(quit ? "Quit" : "Open")) s.ask(request::Leave{});
    tip(saves ? "What is not saved is lost" : "The run saves itself and ends");
    ImGui::SameLine();
    if (ImGui::Button("Stay")) s.ask(request::Stay{});
    tip("Esc");
    ImGui::End();
}

struct TabRow {
    Tab tab;
    const char* name;
    const char* tip;
    void (*draw)(Session&);
    bool (*there)(const Session&);
};

constexpr auto kAlways = [](const Session&) { return true; };
constexpr auto kWithScene = [](const Session& s) { return s.scene != nullptr; };

void scene_tab(Session& s) {
    scene_panel(s);
    layers_panel(s);
}

void measure_tab(Session& s) {
    measure_panel(s);
    notes_panel(s);
}

void view_tab(Session& s) {
    display_panel(s);
    ImGui::Spacing();
    ImGui::TextDisabled("For experts");
    kernel_panel(s);
    accuracy_panel(s);
    effects_panel(s);
    performance_panel(s);
}

constexpr TabRow kTabs[] = {
    {Tab::training, "Training", "How the run goes, and what of it may change", training_panel,
     [](const Session& s) { return s.training.live; }},
    {Tab::scene, "Scene", "Open, save, publish; layers", scene_tab,
     [](const Session& s) { return !s.training.live || s.scene; }},
    {Tab::view, "View", "What is drawn, and how accurately", view_tab, kAlways},
    {Tab::camera, "Camera", "Where the picture is seen from; photos and their cameras",
     camera_panel, kAlways},
    {Tab::splats, "Splats", "Select, clean up and edit splats", edit_panel, kWithScene},
    {Tab::mesh, "Mesh", "A surface from the splats, or from a file", mesh_panel, kWithScene},
    {Tab::measure, "Measure", "Lengths, areas, scale and notes", measure_tab, kWithScene},
    {Tab::film, "Film", "A path of the camera, as a film", path_panel, kAlways},
};

const TabRow& shown_tab(const Session& s) {
    const TabRow* first = nullptr;
    for (const TabRow& row : kTabs) {
        if (!row.there(s)) continue;
        if (row.tab == s.tab) return row;
        if (first == nullptr) first = &row;
    }
    return *first;
}

// Two rows of buttons of one width, so that every name is readable at every scale.
void tab_buttons(Session& s, const TabRow& shown) {
    constexpr int kColumns = 4;
    const float gap = 4 * s.gui_scale;
    const float width =
        std::floor((ImGui::GetContentRegionAvail().x - (kColumns - 1) * gap) / kColumns);
    int column = 0;
    for (const TabRow& row : kTabs) {
        if (!row.there(s)) continue;
        if (column++ % kColumns != 0) ImGui::SameLine(0, gap);
        const bool on = &row == &shown;
        if (on)
            ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
        if (ImGui::Button(row.name, ImVec2(width, 0))) s.tab = row.tab;
        tip(row.tip);
        if (on) ImGui::PopStyleColor();
    }
    ImGui::Separator();
}

void properties(Session& s) {
    const TabRow& shown = shown_tab(s);
    tab_buttons(s, shown);
    const float status = s.note.empty() ? 0 : 3.4f * ImGui::GetTextLineHeight();
    ImGui::BeginChild("tab", ImVec2(0, -status - (status > 0 ? 8 * s.gui_scale : 0)));
    ImGui::PushItemWidth(150 * s.gui_scale);
    ImGui::PushID(static_cast<int>(shown.tab));
    shown.draw(s);
    ImGui::PopID();
    ImGui::PopItemWidth();
    ImGui::EndChild();
    if (status == 0) return;
    ImGui::Separator();
    ImGui::BeginChild("note");
    ImGui::TextWrapped("%s", s.note.c_str());
    ImGui::EndChild();
}

float side_width(const Session& s, float width) {
    return std::min(kSide * s.gui_scale, kMostSide * width);
}

// px that the toolbar may take
float toolbar_room(const Session& s, float width) {
    return (1 - float(kLeastFree)) * width - side_width(s, width);
}

void side_panels(Session& s, float width, float height) {
    const float top = std::round(kMenu * s.gui_scale), side = std::round(side_width(s, width));
    const float outliner =
        std::round(std::clamp(kOutlinerShare * (height - top), kLeastOutliner * s.gui_scale,
                              kMostOutliner * s.gui_scale));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
    ImGui::SetNextWindowPos(ImVec2(width - side, top));
    ImGui::SetNextWindowSize(ImVec2(side, outliner));
    ImGui::Begin("Outliner", nullptr, kDocked);
    draw_outliner(s);
    ImGui::End();
    ImGui::SetNextWindowPos(ImVec2(width - side, top + outliner));
    ImGui::SetNextWindowSize(ImVec2(side, std::max(height - top - outliner, 1.0f)));
    ImGui::Begin("Properties", nullptr, kDocked);
    properties(s);
    ImGui::End();
    ImGui::PopStyleVar();
}

void follow_work(Session& s) {
    const Worked now{s.tools.tool,
                     s.scene && s.edit.selected_count() > 0,
                     s.mesh != nullptr,
                     s.training.live && !s.training.finished,
                     s.photos.current,
                     s.scene.get(),
                     s.scene ? s.edit.layers().size() : 0};
    if (const std::optional<Tab> tab = tab_of_change(s.worked, now)) s.tab = *tab;
    s.worked = now;
}

}  // namespace

std::optional<Tab> tab_of_change(const Worked& before, const Worked& now) {
    if (now.run && !before.run) return Tab::training;
    if (now.scene != before.scene && now.scene != nullptr) return Tab::scene;
    if (now.layers > 1 && now.layers != before.layers) return Tab::scene;
    if (now.tool != before.tool && now.tool == Tool::measure) return Tab::measure;
    if (now.tool != before.tool && now.tool != Tool::navigate) return Tab::splats;
    if (now.selected && !before.selected) return Tab::splats;
    if (now.mesh && !before.mesh) return Tab::mesh;
    if (now.camera != before.camera && now.camera >= 0) return Tab::camera;
    return {};
}

void draw_panels(Session& s) {
    const auto [width, height] = ImGui::GetIO().DisplaySize;
    follow_work(s);
    draw_panes(s);
    s.outliner.shown = false;  // unless the list is drawn
    if (s.panels) {
        const int w = static_cast<int>(width), h = static_cast<int>(height);
        draw_guides(s, w, h);
        draw_measurement(s, w, h);
        draw_notes(s, w, h);
        draw_tools(s, w, h);
        if (s.selection.shown) draw_region(s, w, h);
        draw_menus(s);
        draw_toolbar(s, std::round(kMenu * s.gui_scale), height, toolbar_room(s, width));
        side_panels(s, width, height);
    }
    draw_splash(s);
    progress_window(s, width, height);
    train_window(s);
    open_window(s);
    help_window(s);
    leaving_window(s, width, height);
    error_window(s, width, height);
    if (s.panels) draw_toasts(s);
}

bool asks_before_quitting(const Session& s) {
    return unsaved_edits(s) || unsaved_mesh(s) || s.train_form.runs;
}

WindowArea free_area(const Session& s, int width, int height) {
    WindowArea area{width, height};
    if (!s.panels) return area;
    const float wide = static_cast<float>(width), menu = std::round(kMenu * s.gui_scale);
    const float left = toolbar_width(s.gui_scale, static_cast<float>(height) - menu,
                                     toolbar_room(s, wide)),
                right = side_width(s, wide);
    if (static_cast<float>(height) > kLeastHeight * kMenu * s.gui_scale)
        area.top = static_cast<int>(std::lround(kMenu * s.gui_scale));
    if (static_cast<float>(width) - left - right < kLeastFree * width) return area;
    area.left = static_cast<int>(std::lround(left));
    area.right = static_cast<int>(std::lround(right));
    return area;
}

}  // namespace darb
