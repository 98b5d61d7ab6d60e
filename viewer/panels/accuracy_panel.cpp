// Accuracy settings and effects as switches, each choice with its measured time and error beside
// it.
#include <imgui.h>

#include <cmath>
#include <string>

#include "viewer/panels/panels.h"
#include "viewer/switches.h"

namespace darb {

namespace {

void presets(Accuracy& accuracy) {
    for (int preset = 0; preset < kPresetCount; ++preset) {
        if (preset > 0) ImGui::SameLine();
        const Accuracy wanted = preset_accuracy(preset);
        bool is_chosen = true;
        for (const int row : kAccuracyRows) is_chosen &= wanted.choice[row] == accuracy.choice[row];
        if (ImGui::RadioButton(std::string(preset_name(preset)).c_str(), is_chosen))
            for (const int row : kAccuracyRows) accuracy.choice[row] = wanted.choice[row];
    }
}

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

void switch_row(Session& s, int row) {
    ImGui::TextDisabled("%s", row_name(row).c_str());
    ImGui::PushID(row);
    int choice = 0;
    for (const std::string& name : row_choices(row, s.shown_sh_degree)) {
        if (ImGui::RadioButton(name.c_str(), chosen(row, s.display) == choice))
            choose(row, choice, s.display);
        const std::string text = measured_text(s, row, choice++);
        if (text.empty()) continue;
        ImGui::SameLine(130 * s.gui_scale);
        ImGui::TextUnformatted(text.c_str());
    }
    ImGui::PopID();
}

}  // namespace

void accuracy_panel(Session& s) {
    if (!ImGui::CollapsingHeader("Accuracy and effects")) return;
    if (ImGui::Button("Measure here")) s.requests.measure = true;
    ImGui::TextWrapped("Time on the device, error of the 8-bit picture against the exact one.");
    presets(s.display.accuracy);
    for (const int row : kAccuracyRows) switch_row(s, row);
    ImGui::Separator();
    for (const int row : kEffectRows) switch_row(s, row);
}

}  // namespace darb
