// SPDX-License-Identifier: MIT
// The list of what is there: the scene, its cameras, a mesh, what was measured and the camera path.
// A click shows the properties of one.
#include <fmt/format.h>
#include <imgui.h>

#include <string>

#include "engine/scene/splat_file.h"
#include "viewer/panels/panels.h"

namespace darb {

namespace {

void row(Session& s, Tab tab, const std::string& name, const std::string& what) {
    const float room = ImGui::GetContentRegionAvail().x,
                width = ImGui::CalcTextSize(what.c_str()).x;
    const std::string shown = cut_text(name, room - width - 8 * s.gui_scale);
    if (ImGui::Selectable((shown + "##" + name).c_str(), s.tab == tab)) s.tab = tab;
    if (shown != name) tip(name.c_str());
    ImGui::SameLine(ImGui::GetContentRegionMax().x - width);
    ImGui::TextDisabled("%s", what.c_str());
}

}  // namespace

void draw_outliner(Session& s) {
    if (s.training.live && !s.scene)
        row(s, Tab::training, "Training run",
            count_text(s.training.splats.empty()
                           ? 0
                           : static_cast<std::size_t>(s.training.splats.back())) +
                " splats");
    if (s.scene) {
        row(s, Tab::scene, scene_name(s.scene->file, true),
            count_text(s.scene->model.size() - s.edit.removed_count()) +
                (s.scene->is_points ? " points" : " splats"));
        if (s.edit.selected_count() > 0)
            row(s, Tab::splats, "Selection", count_text(s.edit.selected_count()) + " splats");
    }
    if (s.mesh) row(s, Tab::mesh, "Mesh", count_text(s.mesh->mesh.face_count()) + " faces");
    if (!s.photos.views.empty())
        row(s, Tab::camera, "Cameras", counted(s.photos.views.size(), "photo"));
    if (const std::size_t points = s.scene ? s.edit.facts().measured.points.size() : 0; points > 0)
        row(s, Tab::measure, "Measurement", counted(points, "point"));
    if (!s.path.path.keys.empty())
        row(s, Tab::film, "Camera path", counted(s.path.path.keys.size(), "key frame"));
    if (!s.scene && !s.training.live) ImGui::TextDisabled("Nothing is open.");
}

}  // namespace darb
