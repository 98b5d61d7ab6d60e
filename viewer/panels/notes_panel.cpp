// SPDX-License-Identifier: MIT
// Notes: labels at places of the scene, which a project keeps.
#include <imgui.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>

#include "viewer/layers.h"
#include "viewer/panels/panels.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr ImU32 kNoteBack = IM_COL32(16, 18, 22, 225), kNotePin = IM_COL32(91, 168, 255, 255);
constexpr ImU32 kNoteTitle = IM_COL32(242, 245, 250, 255);
constexpr std::size_t kMostLetters = 2000;

void text_of(const std::string& from, char* to, std::size_t size) {
    std::strncpy(to, from.c_str(), size - 1);
    to[size - 1] = '\0';
}

void draft_fields(NoteDraft& draft) {
    char title[200], text[kMostLetters];
    text_of(draft.note.title, title, sizeof title);
    text_of(draft.note.text, text, sizeof text);
    if (ImGui::InputText("title", title, sizeof title)) draft.note.title = title;
    tip("The label in the picture");
    if (ImGui::InputTextMultiline("text", text, sizeof text,
                                  ImVec2(0, 3.5f * ImGui::GetTextLineHeight())))
        draft.note.text = text;
    tip("Shown while the pointer rests on the label");
}

void add_row(Session& s) {
    NoteDraft& draft = s.note_draft;
    const std::vector<glm::dvec3>& points = s.edit.facts().measured.points;
    const bool changes = draft.replaces >= 0;
    if (!changes && points.empty()) {
        ImGui::TextDisabled("Click a point with 9 to put a note there.");
        return;
    }
    draft_fields(draft);
    ImGui::BeginDisabled(draft.note.title.empty());
    if (ImGui::Button(changes ? "Change note" : "Add note")) {
        if (!changes) draft.note.at = points.back();
        set_note(draft.replaces, draft.note, s);
        draft = {};
    }
    ImGui::EndDisabled();
    tip(changes ? "Keep these words, and the present view of the note"
                : "Put the note at the point that was clicked last, with the present view");
}

}  // namespace

void notes_panel(Session& s) {
    if (!s.scene || !ImGui::CollapsingHeader("Notes")) return;
    ImGui::PushID("notes");
    const std::vector<SceneNote> notes = s.edit.facts().notes;  // a copy, as buttons change them
    for (std::size_t n = 0; n < notes.size(); ++n) {
        ImGui::PushID(static_cast<int>(n));
        if (ImGui::Selectable(notes[n].title.c_str(), false, ImGuiSelectableFlags_None,
                              ImVec2(190 * s.gui_scale, 0)))
            look_at_note(notes[n], s);
        tip("Look at it from where it was made");
        ImGui::SameLine();
        if (ImGui::SmallButton("change")) s.note_draft = {notes[n], static_cast<int>(n)};
        tip("Change its words");
        ImGui::SameLine();
        if (ImGui::SmallButton("delete")) {
            remove_note(n, s);
            s.note_draft = {};
        }
        tip("Delete it; this can be undone");
        ImGui::PopID();
    }
    add_row(s);
    ImGui::PopID();
}

void draw_notes(const Session& s, int width, int height) {
    if (!s.scene || s.edit.facts().notes.empty()) return;
    const Camera camera = camera_in_window(s.photos, s.navigation, free_area(s, width, height));
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const float unit = s.gui_scale;
    const ImVec2 mouse = ImGui::GetIO().MousePos;
    for (const SceneNote& note : s.edit.facts().notes) {
        const std::optional<glm::dvec2> at = pixel_of(camera, note.at);
        if (!at) continue;
        const ImVec2 pin(static_cast<float>(at->x), static_cast<float>(at->y));
        const ImVec2 size = ImGui::CalcTextSize(note.title.c_str());
        const ImVec2 low(pin.x + 12 * unit, pin.y - size.y - 14 * unit);
        const ImVec2 high(low.x + size.x + 12 * unit, low.y + size.y + 6 * unit);
        list.AddLine(pin, ImVec2(low.x, high.y), kNotePin, 1.5f * unit);
        list.AddCircleFilled(pin, 5 * unit, kNoteBack);
        list.AddCircleFilled(pin, 3.5f * unit, kNotePin);
        list.AddRectFilled(low, high, kNoteBack, 4 * unit);
        list.AddRect(low, high, kNotePin, 4 * unit);
        list.AddText(ImVec2(low.x + 6 * unit, low.y + 3 * unit), kNoteTitle, note.title.c_str());
        const bool over = mouse.x >= std::min(pin.x, low.x) && mouse.x <= high.x &&
                          mouse.y >= low.y && mouse.y <= pin.y + 6 * unit;
        if (!over || ImGui::GetIO().WantCaptureMouse || note.text.empty()) continue;
        const float wrap = 300 * unit;
        const ImVec2 box = ImGui::CalcTextSize(note.text.c_str(), nullptr, false, wrap);
        const ImVec2 corner(low.x, pin.y + 10 * unit);
        list.AddRectFilled(corner,
                           ImVec2(corner.x + box.x + 12 * unit, corner.y + box.y + 8 * unit),
                           kNoteBack, 4 * unit);
        list.AddText(ImGui::GetFont(), ImGui::GetFontSize(),
                     ImVec2(corner.x + 6 * unit, corner.y + 4 * unit), kNoteTitle,
                     note.text.c_str(), nullptr, wrap);
    }
}

}  // namespace darb
