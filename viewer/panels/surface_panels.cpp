// SPDX-License-Identifier: MIT
// The surface of a scene: a mesh that is shown with it, and what is measured on it.
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <string>
#include <vector>

#include "engine/mesh/mesh_file.h"
#include "viewer/panels/panels.h"
#include "viewer/tools.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr ImU32 kMeasured = IM_COL32(255, 225, 80, 255), kShade = IM_COL32(0, 0, 0, 170);
constexpr ImU32 kInside = IM_COL32(255, 225, 80, 45), kLengthText = IM_COL32(255, 250, 225, 255);

void how_shown(Session& s) {
    DisplaySettings& d = s.display;
    int show = static_cast<int>(d.mesh), look = static_cast<int>(d.mesh_look);
    if (ImGui::Combo("show##mesh", &show, "splats\0mesh\0both\0side by side\0"))
        d.mesh = static_cast<MeshShow>(show);
    tip("The splats, the mesh, both in one picture, where each hides what is behind it, or both in "
        "strips whose line can be dragged; only while the picture is shown");
    if (ImGui::Combo("mesh as", &look, "colours\0shape\0shape with edges\0"))
        d.mesh_look = static_cast<MeshLook>(look);
    tip("The colours of its vertices, or its shape in grey, with or without the edges of the "
        "faces");
    if (d.mesh != MeshShow::both) return;
    float percent = 100 * d.mesh_nearer;
    if (slider("bring forward", &percent, 0, 10, "%.1f %% of the depth", kLogarithmic))
        d.mesh_nearer = percent / 100;
    tip("How much nearer than it is the mesh counts; splats whose centre is behind it are hidden");
}

void make_one(Session& s) {
    if (s.scene->is_points) return;
    if (!ImGui::TreeNode("Make mesh")) return;
    MeshWish& w = s.mesh_wish;
    const float speed = static_cast<float>(s.scene->bounds.radius / 2000);
    ImGui::DragFloat("voxel", &w.voxel, speed, 0, 1e6f, w.voxel > 0 ? "%.4g units" : "automatic",
                     kClamped);
    tip("Side of a voxel, in units of the scene; what is smaller than two is lost. 0: by the size "
        "of the pixels");
    ImGui::InputInt("faces", &w.faces, 0);
    tip("Simplify the mesh to so many faces; 0 keeps all");
    w.faces = std::max(w.faces, 0);
    ImGui::Checkbox("thin parts", &w.thin);
    tip("Keep what is as thin as a voxel; this takes longer");
    ImGui::BeginDisabled(s.photos.views.empty());
    ImGui::SameLine();
    ImGui::Checkbox("cameras around it", &w.around);
    ImGui::EndDisabled();
    tip(s.photos.views.empty() ? "There are no cameras of photos: 32 around the scene see it"
                               : "Use 32 cameras around the scene, not those of the photos");
    ImGui::BeginDisabled(s.progress.mesh >= 0);
    if (ImGui::Button("Make")) s.ask(request::MakeMesh{});
    ImGui::EndDisabled();
    tip("Make a mesh of the scene as it is edited, as darb mesh does; it can be cancelled (Esc)");
    ImGui::TreePop();
}

}  // namespace

void mesh_panel(Session& s) {
    if (s.mesh) {
        ImGui::Text("%s faces%s%s", count_text(s.mesh->mesh.face_count()).c_str(),
                    s.mesh->file.empty() ? "" : ", ", s.mesh->file.filename().string().c_str());
        for (const std::string& note : s.mesh->notes) ImGui::TextWrapped("%s", note.c_str());
        how_shown(s);
    } else {
        ImGui::TextWrapped("Drop a mesh on the window, or make one.");
    }
    make_one(s);
    path_field("file", s.mesh_file,
               ("The ending of the name decides the format: " + mesh_endings()).c_str());
    if (ImGui::Button("Open mesh")) s.ask(request::OpenMesh{s.mesh_file});
    tip("Show the mesh of this file with the scene");
    ImGui::BeginDisabled(!s.mesh);
    ImGui::SameLine();
    if (ImGui::Button("Save mesh as")) s.ask(request::SaveMesh{});
    tip("Write the mesh to this file");
    ImGui::SameLine();
    if (ImGui::Button("Close mesh")) s.ask(request::CloseMesh{});
    tip("Show the splats alone again");
    ImGui::EndDisabled();
}

// Measuring.

namespace {

void lengths_table(Session& s, const MeasuredLengths& lengths, double unit) {
    ToolState& t = s.tools;
    if (lengths.sides.size() > 1) {
        for (std::size_t i = 0; i < lengths.sides.size(); ++i) {
            const std::string text =
                fmt::format("{}: {}", i + 1, length_text(lengths.sides[i], unit));
            if (ImGui::RadioButton(text.c_str(), t.known_side == static_cast<int>(i)))
                t.known_side = static_cast<int>(i);
            tip("A side; choose the one whose true length you know");
        }
    }
    const std::string whole =
        fmt::format("{}: {}", lengths.sides.size() > 1 ? "length" : "distance",
                    length_text(lengths.total, unit));
    if (ImGui::RadioButton(whole.c_str(), t.known_side < 0)) t.known_side = -1;
    tip("Of all sides together");
    if (lengths.area) {
        ImGui::Text("area: %s", length_text(*lengths.area, unit, 2).c_str());
        tip("Of the outline, projected onto the plane that fits it best");
        if (lengths.sides.size() > 3)
            ImGui::Text("flat within %s", length_text(*lengths.off_plane, unit).c_str());
        return;
    }
    ImGui::Text("height: %s", length_text(lengths.height, unit).c_str());
    tip("How far the last point is above the first, along the scene's up");
    ImGui::Text("horizontal: %s", length_text(lengths.across, unit).c_str());
    tip("Between the first and the last point, without the height");
}

void scale_row(Session& s, const MeasuredLengths& lengths) {
    ToolState& t = s.tools;
    ImGui::SetNextItemWidth(100 * s.gui_scale);
    ImGui::InputDouble("##true", &t.known_metres, 0, 0, "%.6g m");
    tip("The true length of what is chosen above, in metres");
    ImGui::SameLine();
    if (ImGui::Button("Set scale"))
        s.attempt([&] { set_known_length(t.known_side, t.known_metres, s); });
    tip("All other lengths follow from this one; the scale is saved with the scene");
    if (lengths.sides.size() < 2) return;
    ImGui::SameLine();
    if (ImGui::Button("Set ground")) s.attempt([&] { set_ground(s); });
    tip("Turn the view so that these points lie on level ground; the scene is saved upright");
}

}  // namespace

void measure_panel(Session& s) {
    bool on = s.tools.tool == Tool::measure;
    if (ImGui::Checkbox("click points (9)", &on))
        choose_tool(on ? Tool::measure : Tool::navigate, s);
    tip("A click picks a point of the surface, a drag of a point moves it, a click on the first "
        "one closes the outline, Delete takes the last one away; other drags orbit");
    const SceneFacts facts = s.edit.facts();  // a copy, as the buttons change it
    const Measurement& measured = facts.measured;
    if (measured.points.empty()) {
        ImGui::TextDisabled("Nothing is measured yet.");
    } else {
        ImGui::SameLine();
        if (ImGui::Button("Clear")) clear_measurement(s);
        tip("Take all points away; this can be undone");
        const MeasuredLengths lengths = measured_lengths(measured, s.navigation.up);
        if (measured.points.size() > 1) {
            lengths_table(s, lengths, facts.metres_per_unit);
            scale_row(s, lengths);
        } else {
            const glm::dvec3& p = measured.points[0];
            ImGui::Text("at %.5g, %.5g, %.5g", p.x, p.y, p.z);
            tip("In units of the file");
        }
    }
}

namespace {

ImVec2 px_of(const glm::dvec2& p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y)};
}

/// Whether Dear ImGui fills just the inside: the outline always turns the same way.
bool is_convex(const std::vector<ImVec2>& outline) {
    const std::size_t n = outline.size();
    bool left = false, right = false;
    for (std::size_t i = 0; i < n; ++i) {
        const ImVec2 &a = outline[i], &b = outline[(i + 1) % n], &c = outline[(i + 2) % n];
        const float turn = (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x);
        left |= turn < 0;
        right |= turn > 0;
    }
    return !(left && right);
}

void draw_length(const ImVec2& a, const ImVec2& b, const std::string& text, float gui_scale) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddLine(a, b, kShade, 5 * gui_scale);
    list.AddLine(a, b, kMeasured, 2 * gui_scale);
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    const ImVec2 corner((a.x + b.x - size.x) / 2, (a.y + b.y - size.y) / 2);
    list.AddRectFilled(ImVec2(corner.x - 4, corner.y - 2),
                       ImVec2(corner.x + size.x + 4, corner.y + size.y + 2), kShade, 4 * gui_scale);
    list.AddText(corner, kLengthText, text.c_str());
}

}  // namespace

void draw_measurement(const Session& s, int width, int height) {
    if (!s.scene) return;
    const SceneFacts& facts = s.edit.facts();
    const Measurement& measured = facts.measured;
    const Camera camera = camera_in_window(s.photos, s.navigation, free_area(s, width, height));
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    std::vector<std::optional<glm::dvec2>> pixels;
    for (const glm::dvec3& p : measured.points) pixels.push_back(pixel_of(camera, p));
    const bool all = std::ranges::all_of(pixels, [](const auto& p) { return p.has_value(); });
    if (const int held = s.tools.held_point;
        held >= 0 && s.tools.pulled && held < static_cast<int>(pixels.size())) {
        const ImVec2 mouse = ImGui::GetIO().MousePos;
        pixels[static_cast<std::size_t>(held)] = glm::dvec2(mouse.x, mouse.y);
    }
    if (measured.closed && all) {
        std::vector<ImVec2> outline;
        for (const auto& p : pixels) outline.push_back(px_of(*p));
        if (is_convex(outline))
            list.AddConvexPolyFilled(outline.data(), static_cast<int>(outline.size()), kInside);
    }
    const MeasuredLengths lengths = measured_lengths(measured, s.navigation.up);
    for (std::size_t i = 0; i < lengths.sides.size(); ++i) {
        const auto &a = pixels[i], &b = pixels[(i + 1) % pixels.size()];
        if (a && b)
            draw_length(px_of(*a), px_of(*b), length_text(lengths.sides[i], facts.metres_per_unit),
                        s.gui_scale);
    }
    for (const auto& p : pixels) {
        if (!p) continue;
        list.AddCircleFilled(px_of(*p), 6 * s.gui_scale, kShade);
        list.AddCircleFilled(px_of(*p), 4 * s.gui_scale, kMeasured);
    }
}

}  // namespace darb
