// SPDX-License-Identifier: MIT
// The form that begins a training run: what it trains on, how long, what comes of it.
#include <imgui.h>

#include <algorithm>
#include <cfloat>
#include <cstring>
#include <string>
#include <vector>

#include "viewer/commands.h"
#include "viewer/panels/panels.h"

namespace darb {

namespace {

constexpr float kWidth = 640, kLabels = 150, kMostHeight = 620;  // px at scale 1
constexpr float kHigh = 0.9f, kMiddle = 0.53f;  // shares of the height, which leave the menus free

void show_error(const std::string& error) {
    if (error.empty()) return;
    const ThemeColour& c = theme::kComplaint;
    ImGui::PushStyleColor(ImGuiCol_Text, ImVec4(c[0], c[1], c[2], c[3]));
    ImGui::TextWrapped("%s", error.c_str());
    ImGui::PopStyleColor();
}

void text_field(TrainField& field, float width) {
    ImGui::SetNextItemWidth(width);
    char text[1024];
    std::strncpy(text, field.typed.c_str(), sizeof text - 1);
    text[sizeof text - 1] = '\0';
    if (ImGui::InputTextWithHint("##typed", field.usual.c_str(), text, sizeof text))
        field.typed = text;
    tip(field.help.c_str());
}

// A choice is typed or taken from the list.
void choice_field(TrainField& field, float scale) {
    text_field(field, -ImGui::GetFrameHeight() - 1);
    const float right = ImGui::GetItemRectMax().x, left = ImGui::GetItemRectMin().x;
    ImGui::SameLine(0, 1);
    if (ImGui::ArrowButton("choices", ImGuiDir_Down)) ImGui::OpenPopup("choices");
    tip("Choose from a list");
    ImGui::SetNextWindowPos(ImVec2(left, ImGui::GetItemRectMax().y));
    ImGui::SetNextWindowSizeConstraints(
        ImVec2(right - left, 0),
        ImVec2(ImGui::GetIO().DisplaySize.x, 14 * ImGui::GetFrameHeight()));
    if (!ImGui::BeginPopup("choices")) return;
    const std::string usual =
        field.usual.empty() ? "as usual" : "as usual: " + cut_text(field.usual, 360 * scale);
    if (ImGui::Selectable(usual.c_str(), field.typed.empty())) field.typed.clear();
    for (std::size_t i = 0; i < field.choices.size(); ++i) {
        const std::string& choice = field.choices[i];
        if (ImGui::Selectable(choice.c_str(), choice == field.typed)) field.typed = choice;
        if (i >= field.notes.size()) continue;
        ImGui::SameLine(90 * scale);
        ImGui::TextDisabled("%s", field.notes[i].c_str());
    }
    ImGui::EndPopup();
}

void place_field(TrainField& field, Session& s) {
    const bool chooses = field.name == kDatasetField;
    std::filesystem::path path = field.typed;
    const ImGuiStyle& style = ImGui::GetStyle();
    const float button =
        ImGui::CalcTextSize("Choose ...").x + 2 * style.FramePadding.x + style.ItemSpacing.x;
    ImGui::SetNextItemWidth(chooses ? -button : -FLT_MIN);
    path_field("##typed", path, field.help.c_str());
    field.typed = path.string();
    if (!chooses) return;
    ImGui::SameLine();
    if (ImGui::Button("Choose ...")) s.ask(request::ShowOpen{OpenFor::training});
    tip("Choose a folder of photos, a data set or a video");
}

void draw_field(TrainField& field, Session& s) {
    const float labels = kLabels * s.gui_scale;
    ImGui::PushID(field.name.c_str());
    ImGui::AlignTextToFramePadding();
    const std::string label = cut_text(field.label, labels - 8 * s.gui_scale);
    ImGui::TextUnformatted(label.c_str());
    tip((field.name + "\n" + field.help).c_str());
    ImGui::SameLine(labels);
    ImGui::BeginGroup();
    switch (field.kind) {
        case TrainField::Kind::text:
            text_field(field, -FLT_MIN);
            break;
        case TrainField::Kind::choice:
            choice_field(field, s.gui_scale);
            break;
        case TrainField::Kind::place:
            place_field(field, s);
            break;
    }
    show_error(field.error);
    ImGui::EndGroup();
    ImGui::PopID();
}

void expert_fields(TrainForm& form, Session& s) {
    ImGui::Spacing();
    bool wrong = false, folded = false;
    for (const TrainField& field : form.fields) {
        folded |= !field.heading.empty();
        wrong |= !field.heading.empty() && !field.error.empty();
    }
    if (!folded) return;
    if (wrong) ImGui::SetNextItemOpen(true);  // an error that is folded away stops nobody
    if (!ImGui::CollapsingHeader("For experts")) return;
    std::vector<std::string> headings;
    for (const TrainField& field : form.fields)
        if (!field.heading.empty() && std::ranges::find(headings, field.heading) == headings.end())
            headings.push_back(field.heading);
    for (const std::string& heading : headings) {
        int typed = 0;
        bool errors = false;
        for (const TrainField& field : form.fields)
            if (field.heading == heading) {
                typed += field.typed.empty() ? 0 : 1;
                errors |= !field.error.empty();
            }
        const std::string title = heading +
                                  (typed > 0 ? " (" + std::to_string(typed) + " changed)" : "") +
                                  "###" + heading;
        if (errors) ImGui::SetNextItemOpen(true);
        if (!ImGui::TreeNode(title.c_str())) continue;
        for (TrainField& field : form.fields)
            if (field.heading == heading) draw_field(field, s);
        ImGui::TreePop();
    }
}

void lines(const std::vector<std::string>& text) {
    for (const std::string& line : text) ImGui::TextWrapped("%s", line.c_str());
}

void outlook(const TrainForm& form) {
    const TrainOutlook& o = form.outlook;
    ImGui::Separator();
    if (o.holds.empty() && o.forecast.empty() && o.looking.empty())
        ImGui::TextDisabled(
            "Choose photos: a folder of them, a video, or a data set with cameras.");
    lines(o.holds);
    if (!o.forecast.empty()) {
        ImGui::Spacing();
        ImGui::TextDisabled("Forecast for this device");
        lines(o.forecast);
    }
    if (!o.looking.empty()) ImGui::TextDisabled("%s ...", o.looking.c_str());
}

void form_buttons(TrainForm& form) {
    if (!form.stage.empty()) {
        ImGui::TextWrapped("%s", form.stage.c_str());
        if (ImGui::Button("Cancel")) form.cancels = true;
        tip("End the run before it begins; what COLMAP has found is kept");
        return;
    }
    const TrainField* const photos = form.field(kDatasetField);
    const bool ready = photos != nullptr && !photos->typed.empty() && !form.has_error();
    ImGui::BeginDisabled(!ready);
    if (ImGui::Button("Start training")) form.starts = true;
    ImGui::EndDisabled();
    tip(ready              ? "The window then shows the run"
        : form.has_error() ? "Mend what is red first"
                           : "Choose photos first");
    ImGui::SameLine();
    if (ImGui::Button("Close")) form.shown = false;
    tip("Esc; what was typed stays");
}

}  // namespace

void train_window(Session& s) {
    TrainForm& form = s.train_form;
    if (!form.shown || !form.offered()) return;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const float unit = s.gui_scale;
    ImGui::SetNextWindowPos(ImVec2(size.x / 2, kMiddle * size.y), ImGuiCond_Appearing,
                            ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSize(
        ImVec2(std::min(size.x, kWidth * unit), std::min(kHigh * size.y, kMostHeight * unit)),
        ImGuiCond_Appearing);
    ImGui::Begin("Train a scene from photos", &form.shown, ImGuiWindowFlags_NoCollapse);
    const float foot = ImGui::GetFrameHeightWithSpacing() +
                       (form.stage.empty() ? 0 : 2.2f * ImGui::GetTextLineHeightWithSpacing());
    ImGui::BeginChild("fields", ImVec2(0, -foot - 4 * unit));
    const std::vector<TrainField> before = form.fields;
    ImGui::BeginDisabled(!form.stage.empty() || form.runs);
    for (TrainField& field : form.fields)
        if (field.heading.empty()) draw_field(field, s);
    expert_fields(form, s);
    ImGui::EndDisabled();
    if (form.fields != before) ++form.version;
    outlook(form);
    show_error(form.error);
    ImGui::EndChild();
    form_buttons(form);
    ImGui::End();
}

}  // namespace darb
