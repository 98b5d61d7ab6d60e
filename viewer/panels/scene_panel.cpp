// SPDX-License-Identifier: MIT
// The scene that is open, and how it is displayed.
#include <imgui.h>
#include <string>
#include <vector>

#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/splat_file.h"
#include "viewer/panels/panels.h"

namespace darb {

namespace {

void kernel_choice(Session& s) {
    DisplaySettings& d = s.display;
    const std::string now(kernel_name(d.kernel));
    if (ImGui::BeginCombo("kernel", now.c_str())) {
        std::vector<int> kernels = known_kernels();
        if (kernel_has_shape(s.own.kernel)) kernels.push_back(s.own.kernel);
        for (const int k : kernels) {
            const std::string name(kernel_name(k));
            if (ImGui::Selectable(name.c_str(), k == d.kernel)) d.kernel = k;
        }
        ImGui::EndCombo();
    }
    tip("The profile with which all splats are drawn");
    int footprint = d.footprint == Footprint::exact ? 1 : 0;
    ImGui::BeginDisabled(!has_exact_footprint(d.kernel));
    if (ImGui::Combo("footprint", &footprint, "psi\0exact\0"))
        d.footprint = footprint == 1 ? Footprint::exact : Footprint::psi;
    ImGui::EndDisabled();
    tip("How a splat is projected: psi, a fitted Gaussian-like curve, or the exact line integral "
        "where the kernel has one");
    if (!s.scene) return;
    const SplatModel& m = s.scene->shown();
    if (m.kernel == d.kernel && m.footprint == d.footprint) return;
    ImGui::TextWrapped("The scene was trained with %s, %s.",
                       std::string(kernel_name(m.kernel)).c_str(),
                       std::string(footprint_name(m.footprint)).c_str());
    if (ImGui::Button("Back to the scene's own")) {
        d.kernel = m.kernel;
        d.footprint = m.footprint;
    }
    tip("Use the kernel and the footprint of the file");
}

}  // namespace

void scene_panel(Session& s) {
    if (!s.training.live || s.training.finished) {
        if (ImGui::Button("Open ...")) s.ask(request::ShowOpen{});
        tip("Choose a scene in a folder, or one that was opened before (Ctrl+O)");
    }
    if (!s.scene || !ImGui::CollapsingHeader("Scene", ImGuiTreeNodeFlags_DefaultOpen)) return;
    const Scene& scene = *s.scene;
    ImGui::TextWrapped("%s", scene_name(scene.file, true).c_str());
    tip(scene.file.string().c_str());
    if (!scene.is_points)
        ImGui::Text("%zu splats, SH degree %d", scene.model.size() - s.edit.removed_count(),
                    scene.model.sh_degree);
    ImGui::Text("%s, loaded in %.2f s", scene.format.c_str(), scene.load_s);
    if (const double unit = s.edit.facts().metres_per_unit; unit > 0)
        ImGui::Text("a unit is %.4g m", unit);
    for (const std::string& note : scene.notes) ImGui::TextWrapped("%s", note.c_str());
}

void display_panel(Session& s) {
    if (!ImGui::CollapsingHeader("Display", ImGuiTreeNodeFlags_DefaultOpen)) return;
    DisplaySettings& d = s.display;
    constexpr const char* kModes[] = {"picture", "error to photo", "depth", "work per pixel"};
    if (ImGui::BeginCombo("show", kModes[d.mode])) {
        for (int m = 0; m < 4; ++m) {
            if (m == VIEW_ERROR && s.photos.current < 0) continue;
            if (ImGui::Selectable(kModes[m], m == d.mode)) d.mode = m;
        }
        ImGui::EndCombo();
    }
    tip("The picture; its error against the photo, as heat; the depth, where near is light; or how "
        "many splats "
        "each pixel needs");
    if (d.mode == VIEW_ERROR) {
        ImGui::SliderFloat("hottest at", &d.error_max, 0.02f, 1.0f, "%.2f of white", kLogarithmic);
        tip("The mean absolute difference of the three channels that gets the hottest colour");
    }
    if (d.mode == VIEW_COUNT) {
        ImGui::SliderFloat("hottest at", &d.count_max, 10, 10'000, "%.0f splats", kLogarithmic);
        tip("The number of splats per pixel, counted until it is opaque, that gets the hottest "
            "colour");
    }
    if (s.scene) {
        int style = static_cast<int>(d.style);
        if (ImGui::Combo("splats as", &style, "splats\0points\0ellipsoids\0"))
            d.style = static_cast<SplatStyle>(style);
        tip("Splats as they are, dots at their centres, or hard ellipses of two standard "
            "deviations");
    }
    kernel_choice(s);
    panes_panel(s);
    ImGui::ColorEdit3("background", &d.background.x);
    tip("The colour where there is no splat, sRGB");
}

// The open dialog: the scenes of a folder, and those that were opened last.

namespace {

namespace fs = std::filesystem;

void go_to(const fs::path& folder, OpenDialog& dialog) {
    dialog.folder = folder.has_filename() ? folder : folder.parent_path();
    dialog.entries = list_folder(dialog.folder);
}

void choose(const fs::path& file, Session& s) {
    s.ask(request::Open{file, s.open_dialog.merges});
    s.open_dialog.shown = false;
}

void recent_scenes(Session& s) {
    OpenDialog& dialog = s.open_dialog;
    if (dialog.recent.empty()) return;
    ImGui::TextDisabled("recently opened");
    for (std::size_t i = 0; i < dialog.recent.size(); ++i) {
        const fs::path file = dialog.recent[i];
        ImGui::PushID(static_cast<int>(i));
        if (ImGui::Selectable(file.filename().string().c_str())) choose(file, s);
        tip(file.string().c_str());
        ImGui::SameLine();
        ImGui::TextDisabled("%s", file.parent_path().string().c_str());
        ImGui::PopID();
    }
    ImGui::Separator();
}

void folder_entries(Session& s) {
    OpenDialog& dialog = s.open_dialog;
    // a copy, as a choice changes the dialog's
    const std::vector<FolderEntry> entries = dialog.entries;
    for (const FolderEntry& entry : entries) {
        const std::string label = entry.folder ? entry.name + "/" : entry.name;
        if (!ImGui::Selectable(label.c_str())) continue;
        if (entry.folder)
            go_to(dialog.folder / entry.name, dialog);
        else
            choose(dialog.folder / entry.name, s);
    }
    if (entries.empty()) ImGui::TextDisabled("This folder has no scene and no other folder");
}

}  // namespace

void open_window(Session& s) {
    OpenDialog& dialog = s.open_dialog;
    if (!dialog.shown) return;
    if (dialog.folder.empty()) {
        std::error_code none;
        const fs::path beside = s.scene ? s.scene->file.parent_path() : fs::path();
        go_to(fs::absolute(beside.empty() ? fs::path(".") : beside, none).lexically_normal(),
              dialog);
    }
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const float unit = s.gui_scale;
    ImGui::SetNextWindowPos(ImVec2(size.x / 2, size.y / 2), ImGuiCond_Appearing,
                            ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSize(ImVec2(std::min(size.x, 520 * unit), std::min(size.y, 520 * unit)),
                             ImGuiCond_Appearing);
    ImGui::Begin(dialog.merges ? "Merge a scene###open" : "Open a scene###open", &dialog.shown,
                 ImGuiWindowFlags_NoCollapse);
    if (ImGui::Button("Up")) go_to(dialog.folder.parent_path(), dialog);
    tip("Go to the parent folder");
    ImGui::SameLine();
    fs::path typed = dialog.folder;
    ImGui::SetNextItemWidth(-FLT_MIN);
    path_field("##folder", typed);
    tip("The folder; type or paste a path");
    if (typed != dialog.folder) go_to(typed, dialog);
    ImGui::BeginChild("entries", ImVec2(0, 0), true);
    recent_scenes(s);
    folder_entries(s);
    ImGui::EndChild();
    ImGui::End();
}

// The list of keys, and what the mouse does.

namespace {

struct HelpRow {
    const char *input, *does;  // null where input is a heading
};

constexpr HelpRow kHelp[] = {
    {"Camera", nullptr},
    {"left drag", "orbit"},
    {"right drag", "look around"},
    {"middle or Shift+left drag", "pan"},
    {"wheel", "zoom, or change the speed while flying"},
    {"double click", "orbit around this point"},
    {"W A S D Q E", "fly"},
    {"F, L", "frame all, level"},
    {"[ and ]", "cameras of the data set"},
    {"Pictures", nullptr},
    {"drag a line", "move the border between photo and kernels"},
    {"P", "save a picture"},
    {"K, space", "add a key frame, play the path"},
    {"space, .", "during training: pause, do one step"},
    {"Editing", nullptr},
    {"1", "orbit with the left button again"},
    {"2, 3, 4, 5", "select: rectangle, lasso, brush, sphere"},
    {"6, 7, 8", "move, turn, scale"},
    {"9", "measure: click points, drag one, click the first to close"},
    {"Delete while measuring", "take the last point away"},
    {"Shift, Ctrl while selecting", "add, take away"},
    {"Ctrl+A, Ctrl+D, Ctrl+I", "select all, none, or the others"},
    {"Ctrl+H, Ctrl+U", "hide the selection, show everything hidden"},
    {"Delete", "delete the selection"},
    {"Ctrl+Z, Ctrl+Y", "undo, redo"},
    {"Ctrl+S, Ctrl+Q", "save, quit"},
    {"Ctrl+O, or drop a file", "open a scene"},
    {"Window", nullptr},
    {"?, H, F11", "show these keys, hide the panels, full screen"},
    {"Esc", "stop, cancel, close, leave full screen"},
};

}  // namespace

void help_window(Session& s) {
    if (!s.help) return;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(size.x / 2, size.y / 2), ImGuiCond_Appearing,
                            ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSizeConstraints(ImVec2(0, 0), ImVec2(size.x, size.y));
    ImGui::Begin("Keys and mouse", &s.help,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
    if (ImGui::BeginTable("keys", 2)) {
        for (const HelpRow& row : kHelp) {
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            if (row.does == nullptr) {
                ImGui::TextDisabled("%s", row.input);
                continue;
            }
            ImGui::TextUnformatted(row.input);
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(row.does);
        }
        ImGui::EndTable();
    }
    ImGui::TextDisabled("%s", s.device_name.c_str());
    ImGui::End();
}

}  // namespace darb
