// Accuracy settings as switches, each choice with its measured time and error beside it.
#include <imgui.h>

#include <cmath>
#include <string>

#include "viewer/panels/panels.h"

namespace darb {

namespace {

void presets(Accuracy& accuracy) {
    for (int preset = 0; preset < kPresetCount; ++preset) {
        if (preset > 0) ImGui::SameLine();
        const Accuracy wanted = preset_accuracy(preset);
        bool chosen = true;
        for (const int s : kShownAccuracy) chosen &= wanted.choice[s] == accuracy.choice[s];
        if (ImGui::RadioButton(std::string(preset_name(preset)).c_str(), chosen))
            for (const int s : kShownAccuracy) accuracy.choice[s] = wanted.choice[s];
    }
}

std::string measured_text(const Session& s, int setting, int choice) {
    for (const MeasuredChoice& m : s.measured) {
        if (m.setting != setting || m.choice != choice) continue;
        char text[64];
        if (std::isinf(m.psnr_db))
            std::snprintf(text, sizeof text, "%7.2f ms  exact", m.ms);
        else
            std::snprintf(text, sizeof text, "%7.2f ms %6.1f dB", m.ms, m.psnr_db);
        return text;
    }
    return "";
}

}  // namespace

void accuracy_panel(Session& s) {
    if (!ImGui::CollapsingHeader("Accuracy")) return;
    Accuracy& accuracy = s.display.accuracy;
    presets(accuracy);
    for (const int setting : kShownAccuracy) {
        const AccuracySetting& row = accuracy_settings()[setting];
        ImGui::TextDisabled("%s", std::string(row.name).c_str());
        ImGui::PushID(setting);
        for (int c = 0; c < static_cast<int>(row.choices.size()); ++c) {
            if (ImGui::RadioButton(std::string(row.choices[c].name).c_str(),
                                   accuracy.choice[setting] == c))
                accuracy.choice[setting] = c;
            const std::string text = measured_text(s, setting, c);
            if (text.empty()) continue;
            ImGui::SameLine(130 * s.gui_scale);
            ImGui::TextUnformatted(text.c_str());
        }
        ImGui::PopID();
    }
    if (ImGui::Button("Measure here")) s.requests.measure = true;
    ImGui::TextWrapped("Time on the device, error of the 8-bit picture against the exact preset.");
}

}  // namespace darb
