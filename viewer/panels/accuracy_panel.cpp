// Accuracy settings and effects as switches, each choice with its measured time and error beside
// it, each effect with the reason that the plan gives.
#include <imgui.h>

#include <cmath>
#include <string>

#include "viewer/panels/panels.h"
#include "viewer/switches.h"

namespace darb {

namespace {

std::string measured_text(const Session& s, int row, int choice) {
    for (const MeasuredChoice& m : s.measured) {
        if (m.row != row || m.choice != choice) continue;
        char text[64];
        if (std::isinf(m.psnr_db))
            std::snprintf(text, sizeof text, "%7.2f ms   equal", m.ms);
        else
            std::snprintf(text, sizeof text, "%7.2f ms %5.1f dB", m.ms, m.psnr_db);
        return text;
    }
    return "";
}

void choices(Session& s, int row) {
    ImGui::PushID(row);
    int choice = 0;
    for (const std::string& name : row_choices(row, s.sh_degree)) {
        if (ImGui::RadioButton(name.c_str(), chosen(row, s.display) == choice))
            choose(row, choice, s.display);
        tip("time on the device, ms, and PSNR to the exact picture, dB, stand beside it once "
            "measured");
        const std::string text = measured_text(s, row, choice++);
        if (text.empty()) continue;
        ImGui::SameLine(130 * s.gui_scale);
        ImGui::TextUnformatted(text.c_str());
    }
    ImGui::PopID();
}

void measure_button(Session& s) {
    if (ImGui::Button("Measure here")) s.ask(request::Measure{});
    tip("draws the picture with each choice: its time on the device, ms, and the error of the "
        "8-bit picture against the exact one, dB");
}

}  // namespace

void accuracy_panel(Session& s) {
    if (!ImGui::CollapsingHeader("Accuracy")) return;
    ImGui::PushID("accuracy");
    measure_button(s);
    for (const int row : kAccuracyRows) {
        ImGui::TextDisabled("%s", row_name(row).c_str());
        choices(s, row);
    }
    ImGui::PopID();
}

void effects_panel(Session& s) {
    if (!ImGui::CollapsingHeader("Effects")) return;
    ImGui::PushID("effects");
    measure_button(s);
    if (s.plan) {
        if (ImGui::Button("As planned")) s.ask(request::FollowPlan{});
        tip("each effect on or off as darb plan says");
    }
    for (int effect = 0; effect < EFFECT_COUNT; ++effect) {
        const int row = effect_row(effect);
        bool has_switch = false;
        for (const int other : kEffectRows) has_switch |= other == row;
        if (!has_switch && !s.plan) continue;
        ImGui::Separator();
        ImGui::TextUnformatted(row_name(row).c_str());
        if (s.plan) {
            const EffectRow& planned = s.plan->row(effect);
            ImGui::SameLine(90 * s.gui_scale);
            ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
            ImGui::TextWrapped("%s: %s", planned.on ? "on" : "off", planned.reason.c_str());
            ImGui::PopStyleColor();
        }
        if (has_switch) choices(s, row);
    }
    ImGui::PopID();
}

}  // namespace darb
