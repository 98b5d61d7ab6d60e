// Camera paths: key frames, play, export.
#include <imgui.h>

#include <algorithm>

#include "viewer/panels/panels.h"

namespace darb {

void path_panel(Session& s) {
    if (!ImGui::CollapsingHeader("Camera path")) return;
    PathState& p = s.path;
    ImGui::Text("%zu key frames, %.1f s", p.path.keys.size(), p.path.duration());
    if (ImGui::Button("Add (K)")) p.path.add(s.navigation, p.seconds_per_key);
    ImGui::SameLine();
    ImGui::BeginDisabled(p.path.keys.empty());
    if (ImGui::Button("Remove last")) p.path.keys.pop_back();
    ImGui::SameLine();
    if (ImGui::Button(p.playing ? "Stop" : "Play")) p.playing = !p.playing;
    float at = static_cast<float>(p.at_s);
    if (ImGui::SliderFloat("time", &at, 0, static_cast<float>(std::max(p.path.duration(), 0.01)),
                           "%.2f s", kClamped) &&
        !p.path.keys.empty()) {
        p.at_s = at;
        s.ask(request::LeavePhoto{});
        apply(p.path.sample(at), s.navigation);
    }
    ImGui::EndDisabled();
    ImGui::SliderFloat("s per key", &p.seconds_per_key, 0.2f, 10, "%.1f", kClamped);
    path_field("path file", p.file);
    if (ImGui::Button("Load")) s.ask(request::LoadPath{});
    ImGui::SameLine();
    ImGui::BeginDisabled(p.path.keys.empty());
    if (ImGui::Button("Save path")) s.ask(request::SavePath{});
    path_field("folder", p.folder);
    ImGui::SliderInt("frames/s", &p.fps, 1, 120, "%d", kClamped);
    int size[2] = {p.export_width, p.export_height};
    if (ImGui::InputInt2("size", size)) {
        p.export_width = std::clamp(size[0], 16, 8192);
        p.export_height = std::clamp(size[1], 16, 8192);
    }
    if (ImGui::Button("Export frames and video")) s.ask(request::ExportPath{});
    ImGui::EndDisabled();
}

}  // namespace darb
