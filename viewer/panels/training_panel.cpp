// A training run that is followed live: curves, pause, step.
#include <imgui.h>

#include "viewer/panels/panels.h"

namespace darb {

namespace {

void curve(const char* label, const std::vector<float>& values, const char* format, float scale) {
    if (values.empty()) return;
    char text[64];
    std::snprintf(text, sizeof text, format, static_cast<double>(values.back()));
    ImGui::PlotLines("", values.data(), static_cast<int>(values.size()), 0, text, FLT_MAX, FLT_MAX,
                     ImVec2(230 * scale, 50 * scale));
    ImGui::SameLine();
    ImGui::TextUnformatted(label);
}

}  // namespace

void training_panel(Session& s) {
    TrainingCurves& t = s.training;
    if (!t.live || !ImGui::CollapsingHeader("Training", ImGuiTreeNodeFlags_DefaultOpen)) return;
    ImGui::Text("iteration %d of %d", t.iteration, t.last_iteration);
    ImGui::BeginDisabled(t.finished);
    if (ImGui::Button(t.paused ? "Go on" : "Pause")) t.paused = !t.paused;
    tip("the training, key space");
    ImGui::SameLine();
    if (ImGui::Button("Step")) {
        t.paused = true;
        ++t.steps_to_go;
    }
    tip("one iteration, then a pause, key .");
    ImGui::EndDisabled();
    ImGui::SameLine();
    ImGui::TextDisabled(t.finished ? "finished" : "closing goes on training");
    ImGui::PushID("curves");
    curve("loss", t.loss, "%.4f", s.gui_scale);
    curve("PSNR", t.psnr_db, "%.2f dB", s.gui_scale);
    curve("held out", t.held_out_psnr_db, "%.2f dB", s.gui_scale);
    curve("splats", t.splats, "%.0f", s.gui_scale);
    ImGui::PopID();
}

}  // namespace darb
