// The list of keys and what the mouse does.
#include <imgui.h>

#include "viewer/panels/panels.h"

namespace darb {

namespace {

struct HelpRow {
    const char *input, *does;  // does: null where input is a heading
};

constexpr HelpRow kHelp[] = {
    {"Camera", nullptr},
    {"left drag", "orbit"},
    {"right drag", "look around"},
    {"middle or Shift+left drag", "pan"},
    {"wheel", "zoom; in flight, speed"},
    {"double click", "orbit around this"},
    {"W A S D Q E", "fly"},
    {"F, L", "frame all, level"},
    {"[ and ]", "cameras of the data set"},
    {"Pictures", nullptr},
    {"drag a line", "border between photo and kernels"},
    {"P", "save a picture"},
    {"K, space", "add a key frame, play the path"},
    {"space, .", "in training: pause, one step"},
    {"Editing", nullptr},
    {"1", "left drag orbits again"},
    {"2, 3, 4, 5", "select: rectangle, lasso, brush, sphere"},
    {"6, 7, 8", "move, turn, scale"},
    {"Shift, Ctrl while selecting", "add, take away"},
    {"Ctrl+A, Ctrl+D, Ctrl+I", "select all, nothing, the others"},
    {"Ctrl+H, Ctrl+U", "hide the selection, show what is hidden"},
    {"Delete", "delete the selection"},
    {"Ctrl+Z, Ctrl+Y", "undo, redo"},
    {"Ctrl+S, Ctrl+Q", "save, quit"},
    {"Ctrl+O, or drop a file", "open a scene"},
    {"Window", nullptr},
    {"?, H, F11", "these keys, panels, full screen"},
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
