// SPDX-License-Identifier: MIT
// The scene that is open, and how it is displayed.
#include <imgui.h>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/data/image_io.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/report/html.h"
#include "engine/scene/splat_file.h"
#include "viewer/commands.h"
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
    command_button(Key::open, s);
    if (!s.scene) return;
    const Scene& scene = *s.scene;
    ImGui::TextWrapped("%s", scene_name(scene.file, true).c_str());
    tip(scene.file.string().c_str());
    if (!scene.is_points)
        ImGui::Text("%s splats, colours of degree %d",
                    count_text(scene.model.size() - s.edit.removed_count()).c_str(),
                    scene.model.sh_degree);
    ImGui::TextWrapped("%s, loaded in %.2f s", scene.format.c_str(), scene.load_s);
    if (const double unit = s.edit.facts().metres_per_unit; unit > 0)
        ImGui::Text("a unit is %.4g m", unit);
    for (const std::string& note : scene.notes) ImGui::TextWrapped("%s", note.c_str());
    if (scene.is_points) return;
    ImGui::Separator();
    save_panel(s);
}

void display_panel(Session& s) {
    DisplaySettings& d = s.display;
    constexpr const char* kModes[] = {"picture", "difference from photo", "depth",
                                      "splats per pixel"};
    if (ImGui::BeginCombo("show", kModes[d.mode])) {
        for (int m = 0; m < 4; ++m) {
            if (m == VIEW_ERROR && s.photos.current < 0) continue;
            if (ImGui::Selectable(kModes[m], m == d.mode)) d.mode = m;
        }
        ImGui::EndCombo();
    }
    tip("The picture; its difference from the photo; the depth, where near is light; or how many "
        "splats each pixel needs. A bar in the picture says what the colours mean");
    if (d.mode == VIEW_ERROR) {
        slider("lightest at", &d.error_max, 0.02f, 1.0f, "%.2f of white", kLogarithmic);
        tip("The mean absolute difference of the three channels that gets the lightest colour");
    }
    if (d.mode == VIEW_COUNT) {
        slider("lightest at", &d.count_max, 10, 10'000, "%.0f splats", kLogarithmic);
        tip("The number of splats per pixel, counted until it is opaque, that gets the lightest "
            "colour");
    }
    if (s.scene) {
        int style = static_cast<int>(d.style);
        if (ImGui::Combo("splats as", &style, "splats\0points\0ellipsoids\0"))
            d.style = static_cast<SplatStyle>(style);
        tip("Splats as they are, dots at their centres, or hard ellipses of two standard "
            "deviations");
    }
    ImGui::ColorEdit3("background", &d.background.x, ImGuiColorEditFlags_NoInputs);
    tip("The colour where there is no splat, sRGB");
    ImGui::Checkbox("grid", &s.guides.grid);
    tip("Draw a grid on the ground over the picture (G)");
    ImGui::SameLine();
    ImGui::Checkbox("axes", &s.guides.axes);
    tip("Draw the axes in the corner; a click on one looks along it");
    ImGui::SameLine();
    ImGui::BeginDisabled(s.photos.views.empty());
    ImGui::Checkbox("cameras", &s.guides.cameras);
    ImGui::EndDisabled();
    tip("Draw the cameras of the photos; a click on one looks through it (C)");
}

void kernel_panel(Session& s) {
    if (!ImGui::CollapsingHeader("Kernels")) return;
    kernel_choice(s);
    panes_panel(s);
}

// The open dialog: the scenes of a folder, and those that were opened last.

namespace {

namespace fs = std::filesystem;

void go_to(const fs::path& folder, OpenDialog& dialog) {
    dialog.folder = folder.has_filename() ? folder : folder.parent_path();
    dialog.entries = list_folder(dialog.folder, dialog.purpose);
}

void choose(const fs::path& file, Session& s) {
    OpenDialog& dialog = s.open_dialog;
    dialog.shown = false;
    if (dialog.purpose == OpenFor::training)
        s.ask(request::ShowTrain{file});
    else
        s.ask(request::Open{file, dialog.purpose == OpenFor::adding});
}

// "24 photos", for the folder that is shown; counted once for each.
std::string photos_in(OpenDialog& dialog) {
    if (dialog.counted != dialog.folder) {
        dialog.counted = dialog.folder;
        dialog.photos = 0;
        std::error_code none;
        for (const fs::directory_entry& entry : fs::directory_iterator(dialog.folder, none))
            dialog.photos += is_photo_name(entry.path()) ? 1 : 0;
    }
    return dialog.photos == 0 ? "no photos in it" : counted(dialog.photos, "photo") + " in it";
}

void recent_scenes(Session& s) {
    OpenDialog& dialog = s.open_dialog;
    if (dialog.recent.empty() || dialog.purpose == OpenFor::training) return;
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
    if (entries.empty())
        ImGui::TextDisabled(dialog.purpose == OpenFor::training
                                ? "This folder has no other folder and no video"
                                : "This folder has no scene and no other folder");
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
    const bool trains = dialog.purpose == OpenFor::training;
    ImGui::Begin(trains                              ? "Choose photos, a video or a data set###open"
                 : dialog.purpose == OpenFor::adding ? "Add a scene###open"
                                                     : "Open a scene###open",
                 &dialog.shown, ImGuiWindowFlags_NoCollapse);
    if (ImGui::Button("Up")) go_to(dialog.folder.parent_path(), dialog);
    tip("Go to the parent folder");
    ImGui::SameLine();
    fs::path typed = dialog.folder;
    ImGui::SetNextItemWidth(-FLT_MIN);
    path_field("##folder", typed, "The folder; type or paste a path");
    if (typed != dialog.folder) go_to(typed, dialog);
    const float foot = trains ? ImGui::GetFrameHeightWithSpacing() : 0;
    ImGui::BeginChild("entries", ImVec2(0, -foot), true);
    recent_scenes(s);
    folder_entries(s);
    ImGui::EndChild();
    if (trains) {
        if (ImGui::Button("Use this folder")) choose(dialog.folder, s);
        tip("The folder above, with its photos and, where there are some, its cameras");
        ImGui::SameLine();
        ImGui::TextDisabled("%s", photos_in(dialog).c_str());
    }
    ImGui::End();
}

// The list of keys, from the table of commands, and what the mouse does.

namespace {

struct HelpLine {
    std::string input, does;  // no `does`: a heading
};

std::vector<HelpLine> help_lines() {
    std::vector<HelpLine> lines{{"Mouse, and keys that are held", ""}};
    for (const HeldRow& row : held_inputs()) lines.push_back({row.input, row.does});
    for (std::size_t m = 0; m <= kMenuNames.size(); ++m) {
        lines.push_back({m < kMenuNames.size() ? kMenuNames[m] : "Always", ""});
        for (const Command& c : commands())
            if (const std::string keys = keys_text(c);
                c.menu == static_cast<Menu>(m) && !keys.empty())
                lines.push_back({keys, c.name});
    }
    return lines;
}

float widest(const std::vector<HelpLine>& lines, std::string HelpLine::*text) {
    float width = 0;
    for (const HelpLine& line : lines)
        if (!line.does.empty())
            width = std::max(width, ImGui::CalcTextSize((line.*text).c_str()).x);
    return width;
}

// In as many columns as the window has room for.
void help_columns(float room, float scale) {
    const std::vector<HelpLine> lines = help_lines();
    const float input = widest(lines, &HelpLine::input) + 14 * scale;
    const float column = input + widest(lines, &HelpLine::does) + 24 * scale;
    const auto columns =
        static_cast<std::size_t>(std::clamp(std::floor(room / column), 1.0f, 3.0f));
    const std::size_t rows = (lines.size() + columns - 1) / columns;
    const ImVec2 at = ImGui::GetCursorPos();
    const float height = ImGui::GetTextLineHeight() + 4 * scale;
    for (std::size_t i = 0; i < lines.size(); ++i) {
        const ImVec2 place(at.x + column * static_cast<float>(i / rows),
                           at.y + height * static_cast<float>(i % rows));
        ImGui::SetCursorPos(place);
        if (lines[i].does.empty()) {
            ImGui::TextDisabled("%s", lines[i].input.c_str());
            continue;
        }
        ImGui::TextUnformatted(lines[i].input.c_str());
        ImGui::SetCursorPos(ImVec2(place.x + input, place.y));
        ImGui::TextUnformatted(lines[i].does.c_str());
    }
    ImGui::SetCursorPos(ImVec2(at.x, at.y + height * static_cast<float>(rows)));
    ImGui::Dummy(ImVec2(column * static_cast<float>(columns) - 24 * scale, 1));
}

}  // namespace

void help_window(Session& s) {
    if (!s.help) return;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(size.x / 2, size.y / 2), ImGuiCond_Appearing,
                            ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSizeConstraints(ImVec2(0, 0), size);
    ImGui::Begin("Keys and mouse", &s.help,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
    help_columns(size.x - 40 * s.gui_scale, s.gui_scale);
    ImGui::TextDisabled("%s", s.device_name.c_str());
    ImGui::End();
}

}  // namespace darb
