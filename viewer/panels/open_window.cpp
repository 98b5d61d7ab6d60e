// The open dialog: a folder's scenes, and those that were opened last.
#include <imgui.h>

#include "viewer/panels/panels.h"

namespace darb {

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
    ImGui::TextDisabled("opened last");
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
    const std::vector<FolderEntry> entries = dialog.entries;  // a choice changes them
    for (const FolderEntry& entry : entries) {
        const std::string label = entry.folder ? entry.name + "/" : entry.name;
        if (!ImGui::Selectable(label.c_str())) continue;
        if (entry.folder)
            go_to(dialog.folder / entry.name, dialog);
        else
            choose(dialog.folder / entry.name, s);
    }
    if (entries.empty()) ImGui::TextDisabled("no folder and no scene is in here");
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
    tip("the folder above");
    ImGui::SameLine();
    fs::path typed = dialog.folder;
    ImGui::SetNextItemWidth(-FLT_MIN);
    path_field("##folder", typed);
    tip("a folder; type or paste");
    if (typed != dialog.folder) go_to(typed, dialog);
    ImGui::BeginChild("entries", ImVec2(0, 0), true);
    recent_scenes(s);
    folder_entries(s);
    ImGui::EndChild();
    ImGui::End();
}

}  // namespace darb
