// SPDX-License-Identifier: MIT
// Accuracy settings and effects as switches. Each choice has its measured time and error beside it,
// and each effect has the plan's reason.
#include <imgui.h>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "viewer/commands.h"
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
        tip("Once measured, the device time in ms and the PSNR against the exact picture in dB "
            "stand beside it");
        const std::string text = measured_text(s, row, choice++);
        if (text.empty()) continue;
        ImGui::SameLine(130 * s.gui_scale);
        ImGui::TextUnformatted(text.c_str());
    }
    ImGui::PopID();
}

void measure_button(Session& s) {
    if (ImGui::Button("Measure here")) s.ask(request::Measure{});
    tip("Draw the picture with each choice and measure its device time in ms and the error of the "
        "8-bit picture against the exact one in dB");
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
        tip("Switch each effect on or off as darb plan recommends");
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

// The camera: up axis, field of view, cameras of the data set, comparison with the photo.

namespace {

void up_axis(Session& s) {
    Navigation& n = s.navigation;
    if (s.up_is_guess)
        ImGui::Text("up: %s, a guess. Upside down? Flip it:", up_name(n.up).c_str());
    else
        ImGui::Text("up: %s (kept with --up %s)", up_name(n.up).c_str(), up_name(n.up).c_str());
    if (ImGui::Button("Flip")) n.set_up(-n.up);
    tip("Turn the scene over if it is upside down; this is remembered for the file");
    for (int axis = 0; axis < 3; ++axis) {
        ImGui::SameLine();
        constexpr const char* kNames[] = {"X up", "Y up", "Z up"};
        glm::dvec3 up(0.0);
        up[axis] = 1;
        if (ImGui::Button(kNames[axis])) n.set_up(up);
        tip("Make this axis of the file point up; this is remembered for the file");
    }
    ImGui::SameLine();
    if (ImGui::Button("Level")) n.level();
    tip("Remove the camera's roll (L)");
}

void data_set(Session& s) {
    if (s.photos.views.empty()) return;
    ImGui::Separator();
    for (const Key id : {Key::last_camera, Key::next_camera}) {
        command_button(id, s);
        ImGui::SameLine();
    }
    ImGui::NewLine();
    command_button(Key::compare, s);
    camera_thumbnails(s);
}

}  // namespace

void camera_panel(Session& s) {
    command_button(Key::frame_all, s);
    ImGui::SameLine();
    command_button(Key::picture, s);
    if (s.photos.current < 0) {
        float degrees = static_cast<float>(glm::degrees(s.navigation.fov_y));
        if (slider("field of view", &degrees, 10, 120, "%.0f°", kClamped))
            s.navigation.fov_y = glm::radians(static_cast<double>(degrees));
        tip("The angle over the whole height of the window, in degrees");
        float speed = static_cast<float>(s.fly_speed);
        if (ImGui::DragFloat("fly speed", &speed, 0.01f * std::max(speed, 0.01f), 1e-4f, 1e4f,
                             "%.3g units/s", kClamped))
            s.fly_speed = speed;
        tip("Speed of the keys W A S D Q E, in units of the scene a second; the wheel changes it "
            "while flying");
        up_axis(s);
    }
    slider("near", &s.display.near_plane, 0.001f, 10, "%.3f units", kLogarithmic);
    tip("Splats nearer to the camera are not drawn; in units of the scene");
    data_set(s);
}

// Frames per second in motion, and the milliseconds of each pass.

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

// Camera paths: key frames, playing, export.

void path_panel(Session& s) {
    PathState& p = s.path;
    ImGui::Text("%zu key frames, %.1f s", p.path.keys.size(), p.path.duration());
    if (ImGui::Button("Add")) p.path.add(s.navigation, p.seconds_per_key);
    tip("Add a key frame at the camera's position (K)");
    ImGui::SameLine();
    ImGui::BeginDisabled(p.path.keys.empty());
    if (ImGui::Button("Remove last")) p.path.keys.pop_back();
    tip("Remove the key frame that was added last");
    ImGui::SameLine();
    if (ImGui::Button(p.playing ? "Stop" : "Play")) p.playing = !p.playing;
    tip("Fly along the path (space)");
    float at = static_cast<float>(p.at_s);
    if (slider("time", &at, 0, static_cast<float>(std::max(p.path.duration(), 0.01)), "%.2f s",
               kClamped) &&
        !p.path.keys.empty()) {
        p.at_s = at;
        s.ask(request::LeavePhoto{});
        apply(p.path.sample(at), s.navigation);
    }
    tip("The camera's place on the path, in seconds");
    ImGui::EndDisabled();
    slider("per key frame", &p.seconds_per_key, 0.2f, 10, "%.1f s", kClamped);
    tip("Time from the last key frame to the one that is added next");
    path_field("path file", p.file,
               "A JSON file that darb render --path and darb view --path read, too");
    if (ImGui::Button("Load")) s.ask(request::LoadPath{});
    tip("Replace the key frames by those of the path file");
    ImGui::SameLine();
    ImGui::BeginDisabled(p.path.keys.empty());
    if (ImGui::Button("Save path")) s.ask(request::SavePath{});
    tip("Write the key frames to the path file");
    path_field("folder", p.folder,
               "The folder of the exported frames; it is made if it does not exist");
    slider("frames", &p.fps, 1, 120, "%d a second", kClamped);
    tip("Frame rate of the exported video");
    int size[2] = {p.export_width, p.export_height};
    if (ImGui::InputInt2("size, px", size)) {
        p.export_width = std::clamp(size[0], 16, 8192);
        p.export_height = std::clamp(size[1], 16, 8192);
    }
    tip("Width and height of the exported frames, px");
    if (ImGui::Button("Export frames and video")) s.ask(request::ExportPath{});
    tip("Write PNG frames, and video.mp4 if ffmpeg is installed");
    ImGui::EndDisabled();
}

}  // namespace darb
