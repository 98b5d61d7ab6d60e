// Frames per second in motion, milliseconds of each pass.
#include <imgui.h>

#include <numeric>

#include "viewer/panels/panels.h"

namespace darb {

void performance_panel(Session& s) {
    if (!ImGui::CollapsingHeader("Performance")) return;
    const FrameTimes& t = s.times;
    if (!t.moving_ms.empty()) {
        const double mean = std::accumulate(t.moving_ms.begin(), t.moving_ms.end(), 0.0) /
                            double(t.moving_ms.size());
        ImGui::Text("in motion: %.1f frames/s (%.1f ms)", 1000 / mean, mean);
    } else {
        ImGui::TextDisabled("in motion: not moved yet");
    }
    ImGui::Text("at rest: %.1f ms", t.full_ms);
    ImGui::Text("now: %.0f %% of the size, %.0f %% of the splats", t.quality.scale * 100,
                t.quality.splats * 100);
    ImGui::Text("%u visible, %u splat-tile intersections", t.visible, t.intersections);
    double total = 0;
    for (const PassTime& pass : t.passes) total += pass.ms;
    for (const PassTime& pass : t.passes) {
        ImGui::ProgressBar(total > 0 ? static_cast<float>(pass.ms / total) : 0,
                           ImVec2(70 * s.gui_scale, 0), "");
        ImGui::SameLine();
        ImGui::Text("%7.2f ms  %s", pass.ms, pass.name.c_str());
    }
    if (!t.passes.empty()) ImGui::Text("%7.2f ms on the device", total);
}

}  // namespace darb
