// Camera paths: key frames, play, export.
#include <imgui.h>

#include <algorithm>

#include "viewer/panels/panels.h"

namespace darb {

void path_panel(Session& s) {
    if (!ImGui::CollapsingHeader("Camera path")) return;
    PathState& p = s.path;
    ImGui::Text("%zu key frames, %.1f s", p.path.keys.size(), p.path.duration());
    if (ImGui::Button("Add")) p.path.add(s.navigation, p.seconds_per_key);
    tip("a key frame where the camera is, key K");
    ImGui::SameLine();
    ImGui::BeginDisabled(p.path.keys.empty());
    if (ImGui::Button("Remove last")) p.path.keys.pop_back();
    tip("the key frame that was added last");
    ImGui::SameLine();
    if (ImGui::Button(p.playing ? "Stop" : "Play")) p.playing = !p.playing;
    tip("flies along the path, key space");
    float at = static_cast<float>(p.at_s);
    if (ImGui::SliderFloat("time", &at, 0, static_cast<float>(std::max(p.path.duration(), 0.01)),
                           "%.2f s", kClamped) &&
        !p.path.keys.empty()) {
        p.at_s = at;
        s.ask(request::LeavePhoto{});
        apply(p.path.sample(at), s.navigation);
    }
    tip("where on the path the camera is, seconds");
    ImGui::EndDisabled();
    ImGui::SliderFloat("per key frame", &p.seconds_per_key, 0.2f, 10, "%.1f s", kClamped);
    tip("from the key frame before to the one that is added next");
    path_field("path file", p.file);
    tip("JSON; darb render --path and darb view --path read it, too");
    if (ImGui::Button("Load")) s.ask(request::LoadPath{});
    tip("the key frames of the path file, in the place of these");
    ImGui::SameLine();
    ImGui::BeginDisabled(p.path.keys.empty());
    if (ImGui::Button("Save path")) s.ask(request::SavePath{});
    tip("these key frames, to the path file");
    path_field("folder", p.folder);
    tip("of the exported frames; made where it is missing");
    ImGui::SliderInt("frames", &p.fps, 1, 120, "%d a second", kClamped);
    tip("of the exported video");
    int size[2] = {p.export_width, p.export_height};
    if (ImGui::InputInt2("size, px", size)) {
        p.export_width = std::clamp(size[0], 16, 8192);
        p.export_height = std::clamp(size[1], 16, 8192);
    }
    tip("width and height of the exported frames, px");
    if (ImGui::Button("Export frames and video")) s.ask(request::ExportPath{});
    tip("PNG frames, and video.mp4 where ffmpeg is installed");
    ImGui::EndDisabled();
}

}  // namespace darb
