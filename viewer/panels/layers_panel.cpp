// SPDX-License-Identifier: MIT
// The list of layers: what is seen, what is moved, their order; and what a project keeps of them.
#include <imgui.h>

#include <cstring>
#include <string>

#include "engine/kernels/kernel_registry.h"
#include "viewer/layers.h"
#include "viewer/panels/panels.h"

namespace darb {

namespace {

// Counted once for each edit, as there may be millions of splats.
void count_layers(Session& s) {
    OutlinerState& o = s.outliner;
    if (o.version == s.edit.version()) return;
    o.version = s.edit.version();
    o.splats.clear();
    for (const SceneLayer& layer : s.edit.layers()) o.splats.push_back(s.edit.count_in(layer));
    o.losses = s.edit.losses_together();
}

void layer_row(std::size_t n, Session& s) {
    const SceneLayer layer = s.edit.layers()[n];  // a copy, as an edit changes the list
    OutlinerState& o = s.outliner;
    ImGui::PushID(static_cast<int>(n));
    bool visible = layer.visible;
    if (ImGui::Checkbox("##visible", &visible))
        perform_edit(edits::ShowLayer{layer.name, visible}, s);
    tip("Show the layer; a hidden one is left out where all visible layers are saved together");
    ImGui::SameLine();
    if (ImGui::Selectable(layer.name.c_str(), o.active == static_cast<int>(n),
                          ImGuiSelectableFlags_None, ImVec2(170 * s.gui_scale, 0))) {
        o.active = static_cast<int>(n);
        o.editing = false;
        if (layer.visible) perform_edit(edits::Select{by::Layer{layer.name}}, s);
    }
    tip(layer.file.empty() ? "Selects its splats, which 6, 7 and 8 then move, turn and scale"
                           : layer.file.string().c_str());
    ImGui::SameLine();
    ImGui::TextDisabled("%s", count_text(o.splats[n]).c_str());
    tip("Splats of the layer that are not deleted");
    ImGui::PopID();
}

void order_buttons(const SceneLayer& layer, std::size_t n, std::size_t count, Session& s) {
    ImGui::BeginDisabled(n == 0);
    if (ImGui::ArrowButton("up", ImGuiDir_Up)) {
        perform_edit(edits::PlaceLayer{layer.name, n - 1}, s);
        --s.outliner.active;
    }
    ImGui::EndDisabled();
    tip("Move the layer up in the list, which is the order of a saved file");
    ImGui::SameLine();
    ImGui::BeginDisabled(n + 1 >= count);
    if (ImGui::ArrowButton("down", ImGuiDir_Down)) {
        perform_edit(edits::PlaceLayer{layer.name, n + 1}, s);
        ++s.outliner.active;
    }
    ImGui::EndDisabled();
    tip("Move the layer down in the list");
    ImGui::SameLine();
    if (ImGui::Button("Copy")) perform_edit(edits::Duplicate{layer.name, ""}, s);
    tip("Add a copy of the layer, which is then selected");
    ImGui::SameLine();
    ImGui::BeginDisabled(n + 1 >= count);
    if (ImGui::Button("Merge down"))
        perform_edit(edits::MergeLayers{layer.name, s.edit.layers()[n + 1].name}, s);
    ImGui::EndDisabled();
    tip("Make one layer of this one and the one below it, where both have one kernel");
    ImGui::SameLine();
    ImGui::BeginDisabled(count < 2);
    if (ImGui::Button("Delete")) perform_edit(edits::RemoveLayer{layer.name}, s);
    ImGui::EndDisabled();
    tip("Delete the layer; this can be undone");
}

// Typed numbers count when the field is left, so that a layer moves once.
void pose_fields(const SceneLayer& layer, std::size_t n, Session& s) {
    OutlinerState& o = s.outliner;
    if (!o.editing) o.pose = pose_of(layer.moved);
    const float speed = static_cast<float>(s.scene->bounds.radius / 200);
    bool begun = false, done = false;
    const auto field = [&](const char* label, glm::dvec3& v, int count, float step,
                           const char* format, const char* what) {
        ImGui::DragScalarN(label, ImGuiDataType_Double, &v.x, count, step, nullptr, nullptr,
                           format);
        begun |= ImGui::IsItemActive();
        done |= ImGui::IsItemDeactivatedAfterEdit();
        tip(what);
    };
    glm::dvec3 scale(o.pose.scale);
    field("move", o.pose.move, 3, speed, "%.3f", "How far the layer was moved, units of the scene");
    field("turn", o.pose.turn, 3, 0.5f, "%.1f", "Degrees about x, then y, then z");
    field("scale", scale, 1, 0.01f, "%.3f", "How many times as large as in its file");
    o.pose.scale = scale.x;
    o.editing = begun;
    if (!done) return;
    o.editing = false;
    if (!(o.pose.scale > 0)) return;
    pose_layer(n, o.pose, s);
}

void name_field(const SceneLayer& layer, Session& s) {
    OutlinerState& o = s.outliner;
    char text[256];
    const std::string& now = o.renaming.empty() ? layer.name : o.renaming;
    std::strncpy(text, now.c_str(), sizeof text - 1);
    text[sizeof text - 1] = '\0';
    if (ImGui::InputText("name", text, sizeof text)) o.renaming = text;
    if (ImGui::IsItemDeactivatedAfterEdit() && !o.renaming.empty())
        perform_edit(edits::RenameLayer{layer.name, o.renaming}, s);
    if (!ImGui::IsItemActive()) o.renaming.clear();
    tip("The name of the layer, which scripts and projects use");
}

}  // namespace

void layers_panel(Session& s) {
    OutlinerState& o = s.outliner;
    o.shown = s.scene != nullptr;
    if (!s.scene) return;
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const std::size_t layers = s.edit.layers().size();
    if (layers > 1 && o.count <= 1) ImGui::SetNextItemOpen(true);
    o.count = layers;
    const bool open = ImGui::CollapsingHeader("Layers");
    tip("Scenes that lie together in this window. A file that is dropped here, or anywhere with "
        "Shift held, is added as a layer");
    o.low = {corner.x, corner.y};
    o.high = {corner.x + ImGui::GetContentRegionAvail().x, ImGui::GetCursorScreenPos().y};
    if (!open) return;
    ImGui::PushID("layers");
    count_layers(s);
    for (std::size_t n = 0; n < o.splats.size() && n < s.edit.layers().size(); ++n) layer_row(n, s);
    for (const std::string& loss : o.losses) ImGui::TextWrapped("%s", loss.c_str());
    if (ImGui::Button("Add ...")) s.ask(request::ShowOpen{OpenFor::adding});
    tip("Add a scene as a layer. Files that are dropped on this list, or with Shift held, are "
        "added, too");
    const std::size_t count = s.edit.layers().size();
    if (count > 1) {
        o.active = std::clamp(o.active, 0, static_cast<int>(count) - 1);
        const auto n = static_cast<std::size_t>(o.active);
        const SceneLayer layer = s.edit.layers()[n];
        ImGui::SameLine();
        if (ImGui::Button("Save this layer")) s.ask(request::SaveScene{layer.name});
        tip("Save the chosen layer alone, in its own kernel, beside the file named under Save as");
        order_buttons(layer, n, count, s);
        if (ImGui::TreeNode("Name and place")) {
            name_field(layer, s);
            ImGui::TextDisabled("%s", std::string(kernel_name(layer.look.kernel)).c_str());
            tip("The kernel of the layer");
            pose_fields(layer, n, s);
            ImGui::TreePop();
        }
    }
    o.high.y = double{ImGui::GetCursorScreenPos().y};
    if (keeps_project(s)) {
        path_field(
            "project", s.project.to_save,
            "Keeps layers, edits, measurements, notes, camera path and view; the splats stay in "
            "their files");
        ImGui::SameLine();
        if (ImGui::Button("Save##project")) s.ask(request::SaveProject{});
        tip("Save the project (Ctrl+S)");
    }
    ImGui::PopID();
}

}  // namespace darb
