// Camera: up axis, field of view, cameras of the data set, comparison with the photo.
#include <imgui.h>

#include <algorithm>

#include "viewer/panels/panels.h"

namespace darb {

namespace {

void up_axis(Session& s) {
    Navigation& n = s.navigation;
    if (s.up_is_guess)
        ImGui::Text("up: %s, a guess. On its head? Flip it:", up_name(n.up).c_str());
    else
        ImGui::Text("up: %s (kept with --up %s)", up_name(n.up).c_str(), up_name(n.up).c_str());
    if (ImGui::Button("Flip")) n.set_up(-n.up);
    tip("the scene stands on its head: turn it over; remembered for the file");
    for (int axis = 0; axis < 3; ++axis) {
        ImGui::SameLine();
        constexpr const char* kNames[] = {"X up", "Y up", "Z up"};
        glm::dvec3 up(0.0);
        up[axis] = 1;
        if (ImGui::Button(kNames[axis])) n.set_up(up);
        tip("this axis of the file points up; remembered for the file");
    }
    ImGui::SameLine();
    if (ImGui::Button("Level")) n.level();
    tip("takes the roll away, key L");
}

void data_set(Session& s) {
    Photos& p = s.photos;
    if (p.views.empty()) return;
    const char* now = p.current < 0 ? "free" : p.views[static_cast<size_t>(p.current)].name.c_str();
    if (ImGui::BeginCombo("data set", now)) {
        for (int i = 0; i < static_cast<int>(p.views.size()); ++i) {
            const View& view = p.views[static_cast<size_t>(i)];
            ImGui::PushID(i);
            if (ImGui::Selectable(view.name.c_str(), i == p.current))
                s.ask(request::ChooseCamera{i});
            ImGui::PopID();
        }
        ImGui::EndCombo();
    }
    tip("look through a camera of the data set; keys [ and ] go to the next");
    if (p.current < 0) {
        ImGui::TextDisabled("[ and ] step through its cameras");
        return;
    }
    if (ImGui::Checkbox("photo beside the picture", &p.compare)) p.failed = false;
    tip("the photo left of a line that can be dragged");
}

}  // namespace

void camera_panel(Session& s) {
    if (!ImGui::CollapsingHeader("Camera", ImGuiTreeNodeFlags_DefaultOpen)) return;
    if (ImGui::Button("Frame all")) s.ask(request::FrameAll{});
    tip("the whole scene beside this panel, key F");
    ImGui::SameLine();
    if (ImGui::Button("Take picture")) s.ask(request::TakePicture{});
    tip("writes darb_001.png, or the next that is free, to the current folder, key P");
    if (s.photos.current < 0) {
        float degrees = static_cast<float>(glm::degrees(s.navigation.fov_y));
        if (ImGui::SliderFloat("field of view", &degrees, 10, 120, "%.0f°", kClamped))
            s.navigation.fov_y = glm::radians(static_cast<double>(degrees));
        tip("over the whole height of the window, degrees");
        float speed = static_cast<float>(s.fly_speed);
        if (ImGui::DragFloat("fly speed", &speed, 0.01f * std::max(speed, 0.01f), 1e-4f, 1e4f,
                             "%.3g units/s", kClamped))
            s.fly_speed = speed;
        tip("of W A S D Q E, in units of the scene a second; the wheel changes it in flight");
        up_axis(s);
    }
    ImGui::SliderFloat("near", &s.display.near_plane, 0.001f, 10, "%.3f units", kLogarithmic);
    tip("what is nearer to the camera is not drawn, in units of the scene");
    data_set(s);
}

}  // namespace darb
