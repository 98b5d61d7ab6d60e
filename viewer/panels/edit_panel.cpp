// SPDX-License-Identifier: MIT
// Tools, selection, undo, merge, save.
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "engine/scene/clutter.h"
#include "engine/scene/splat_file.h"
#include "viewer/panels/panels.h"

namespace darb {

namespace {

constexpr ImU32 kOutline = IM_COL32(255, 200, 60, 255);
constexpr int kCircleSteps = 64;

// The values are doubles, because far from the origin a float has no centimetres left.
bool edit_vector(const char* label, glm::dvec3& v, float speed, int components) {
    return ImGui::DragScalarN(label, ImGuiDataType_Double, &v.x, components, speed, nullptr,
                              nullptr, "%.3f");
}

// Draws the part of the line that is in front of the camera.
void line(const Camera& camera, const glm::dvec3& a, const glm::dvec3& b) {
    glm::dvec3 p = camera.rotation * a + camera.translation;
    glm::dvec3 q = camera.rotation * b + camera.translation;
    constexpr double kNear = 1e-3;
    if (p.z < kNear && q.z < kNear) return;
    glm::dvec3& behind = p.z < q.z ? p : q;
    const glm::dvec3& ahead = p.z < q.z ? q : p;
    if (behind.z < kNear)
        behind = glm::mix(ahead, behind, (ahead.z - kNear) / (ahead.z - behind.z));
    const auto at = [&](const glm::dvec3& v) {
        return ImVec2(static_cast<float>(camera.fx * v.x / v.z + camera.cx),
                      static_cast<float>(camera.fy * v.y / v.z + camera.cy));
    };
    ImGui::GetBackgroundDrawList()->AddLine(at(p), at(q), kOutline, 1.5f);
}

void draw_box(const Camera& camera, const Region& r) {
    for (int corner = 0; corner < 8; ++corner)
        for (int axis = 0; axis < 3; ++axis) {
            if ((corner >> axis & 1) != 0) continue;
            const auto at = [&](int c) {
                return r.centre + r.half_size * glm::dvec3((c & 1) != 0 ? 1 : -1,
                                                           (c & 2) != 0 ? 1 : -1,
                                                           (c & 4) != 0 ? 1 : -1);
            };
            line(camera, at(corner), at(corner | 1 << axis));
        }
}

void draw_sphere(const Camera& camera, const Region& r) {
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < kCircleSteps; ++i) {
            const auto at = [&](int step) {
                const double a = 2 * glm::pi<double>() * step / kCircleSteps;
                glm::dvec3 p(0.0);
                p[(axis + 1) % 3] = std::cos(a);
                p[(axis + 2) % 3] = std::sin(a);
                return r.centre + r.half_size.x * p;
            };
            line(camera, at(i), at(i + 1));
        }
}

void tool_choice(Session& s) {
    constexpr const char* kNames[kToolCount] = {"orbit", "rectangle", "lasso", "brush",  "sphere",
                                                "move",  "turn",      "scale", "measure"};
    constexpr float kColumns[] = {0, 88, 186, 262};  // px at scale 1
    constexpr const char* kTips[kToolCount] = {
        "Drag with the left button to orbit (1)",
        "Select in a rectangle, hidden splats behind others too; Shift adds, Ctrl takes away (2)",
        "Select inside an outline; Shift adds, Ctrl takes away (3)",
        "Select by painting; Shift adds, Ctrl takes away (4)",
        "Select around the splat where the drag begins; Shift adds, Ctrl takes away (5)",
        "Drag an arrow to move the selection, or everything if nothing is selected (6)",
        "Drag a ring to turn the selection, together with its harmonics (7)",
        "Drag the ring to scale the selection (8)",
        "Click points of the surface to measure between them; see the section Measure (9)"};
    for (int i = 0; i < kToolCount; ++i) {
        if (i % 4 != 0) ImGui::SameLine(kColumns[i % 4] * s.gui_scale);
        if (ImGui::RadioButton(kNames[i], static_cast<int>(s.tools.tool) == i))
            choose_tool(static_cast<Tool>(i), s);
        tip(kTips[i]);
    }
    if (s.tools.tool != Tool::brush) return;
    ImGui::SliderFloat("brush", &s.tools.brush_px, 4, 300, "%.0f px", kLogarithmic);
    tip("Radius of the brush on the screen");
}

void select(const Selector& what, Session& s) {
    const ImGuiIO& io = ImGui::GetIO();
    perform_edit(edits::Select{what, io.KeyShift  ? Combine::add
                                     : io.KeyCtrl ? Combine::subtract
                                                  : Combine::replace},
                 s);
}

void selection_buttons(Session& s) {
    ImGui::Text("%zu selected, %zu hidden, %zu deleted", s.edit.selected_count(),
                s.edit.hidden_count(), s.edit.removed_count());
    if (ImGui::Button("All")) select(by::Everything{}, s);
    tip("Ctrl+A");
    ImGui::SameLine();
    if (ImGui::Button("None")) select(by::Nothing{}, s);
    tip("Ctrl+D");
    ImGui::SameLine();
    if (ImGui::Button("Invert")) show_edit(s.edit.invert_selection(), s);
    tip("Ctrl+I");
    ImGui::SameLine();
    if (ImGui::Button("Grow"))
        perform_edit(edits::Select{by::Near{double{s.tools.grow}}, Combine::add}, s);
    tip("Add all splats that are nearer to a selected one than the distance on the right");
    ImGui::SameLine();
    ImGui::SetNextItemWidth(70 * s.gui_scale);
    ImGui::DragFloat("##grow", &s.tools.grow, s.tools.grow / 100, 1e-6f, 1e6f, "%.3g units",
                     kClamped);
    tip("In units of the scene; drag, or Ctrl+click to type");
    if (ImGui::Button("Hide")) show_edit(s.edit.hide_selected(), s);
    tip("Hide the selection (Ctrl+H); hidden splats are still saved");
    ImGui::SameLine();
    if (ImGui::Button("Show")) show_edit(s.edit.show_hidden(), s);
    tip("Show everything that is hidden (Ctrl+U)");
    ImGui::SameLine();
    if (ImGui::Button("Delete")) show_edit(s.edit.remove_selected(), s);
    tip("Delete the selection (Delete)");
}

void undo_buttons(Session& s) {
    ImGui::BeginDisabled(!s.edit.can_undo());
    if (ImGui::Button("Undo")) undo_edit(s);
    ImGui::EndDisabled();
    tip("Ctrl+Z");
    ImGui::SameLine();
    ImGui::BeginDisabled(!s.edit.can_redo());
    if (ImGui::Button("Redo")) redo_edit(s);
    ImGui::EndDisabled();
    tip("Ctrl+Y");
}

void count_values(const SplatModel& model, int version, ValueHistograms& h) {
    if (h.version == version && h.splats == model.size()) return;
    h = {.version = version, .splats = model.size()};
    const std::vector<double> sizes = largest_deviations(model);
    const auto [least, most] = std::ranges::minmax_element(sizes);
    if (sizes.empty() || !(*least > 0) || !std::isfinite(*most)) return;
    h.least = *least;
    h.most = std::max(*most, *least * (1 + 1e-9));
    constexpr double kBins = double(ValueHistograms::kBins);
    const auto bin = [&](double share) {
        return static_cast<std::size_t>(std::clamp(share * kBins, 0.0, kBins - 1));
    };
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        ++h.opacity[bin(sigmoid(double{model.opacity_logit[i]}))];
        ++h.size[bin(std::log(sizes[i] / h.least) / std::log(h.most / h.least))];
    }
    for (float& count : h.opacity) count = std::log1p(count);
    for (float& count : h.size) count = std::log1p(count);
}

/// The histogram, with what the range from `low` to `high` selects, shares of its width, lit up.
void histogram(const char* id, const std::array<float, ValueHistograms::kBins>& counts, double low,
               double high, float gui_scale) {
    const ImVec2 size(ImGui::CalcItemWidth(), 36 * gui_scale), at = ImGui::GetCursorScreenPos();
    ImGui::InvisibleButton(id, size);
    ImDrawList* const list = ImGui::GetWindowDrawList();
    list->AddRectFilled(at, ImVec2(at.x + size.x, at.y + size.y),
                        ImGui::GetColorU32(ImGuiCol_FrameBg));
    const float top = std::max(*std::ranges::max_element(counts), 1.0f);
    constexpr float kBins = float(ValueHistograms::kBins);
    for (std::size_t b = 0; b < counts.size(); ++b) {
        const double middle = (double(b) + 0.5) / double(kBins);
        const bool inside = middle >= low && middle <= high;
        const float x = at.x + size.x * float(b) / kBins;
        list->AddRectFilled(
            ImVec2(x, at.y + size.y * (1 - counts[b] / top)),
            ImVec2(x + size.x / kBins - 1, at.y + size.y),
            ImGui::GetColorU32(inside ? ImGuiCol_PlotHistogramHovered : ImGuiCol_PlotHistogram,
                               inside ? 1.0f : 0.5f));
    }
}

void select_by_value(Session& s) {
    if (!ImGui::TreeNode("Select by value")) return;
    ToolState& t = s.tools;
    const SplatModel& m = s.scene->model;
    const float top = static_cast<float>(s.scene->bounds.radius);
    count_values(m, s.edit.model_version(), t.histograms);
    const ValueHistograms& h = t.histograms;
    histogram("opacities", h.opacity, double{t.opacity[0]}, double{t.opacity[1]}, s.gui_scale);
    tip("How many splats have which opacity, 0 to 1; higher bars stand for many more");
    ImGui::DragFloatRange2("##opacity", &t.opacity[0], &t.opacity[1], 0.005f, 0, 1, "%.3f", "%.3f",
                           kClamped);
    tip("Lowest and highest opacity, 0 to 1");
    ImGui::SameLine();
    if (ImGui::Button("opacity"))
        select(by::Opacity{double{t.opacity[0]}, double{t.opacity[1]}}, s);
    tip("Select the splats in this range; Shift adds, Ctrl takes away");
    const auto place = [&](float size) {
        return h.most > h.least && size > 0
                   ? std::log(double{size} / h.least) / std::log(h.most / h.least)
                   : 0.0;
    };
    histogram("sizes", h.size, place(t.scale[0]), place(t.scale[1]), s.gui_scale);
    tip("How many splats have which size, the smallest of the scene on the left and the largest on "
        "the right, in logarithms");
    ImGui::DragFloatRange2("##scale", &t.scale[0], &t.scale[1], top / 500, 0, 100 * top, "%.3g",
                           "%.3g", kClamped);
    tip("Smallest and largest size: the largest standard deviation, in units of the scene");
    ImGui::SameLine();
    if (ImGui::Button("size")) select(by::Size{double{t.scale[0]}, double{t.scale[1]}}, s);
    tip("Select the splats in this range; Shift adds, Ctrl takes away");
    ImGui::ColorEdit3("##colour", &t.colour.x, ImGuiColorEditFlags_NoInputs);
    tip("The colour to look for, sRGB");
    ImGui::SameLine();
    ImGui::SetNextItemWidth(110 * s.gui_scale);
    ImGui::SliderFloat("##tolerance", &t.tolerance, 0, 1, "within %.2f", kClamped);
    tip("How far each channel may be from it, 0 to 1");
    ImGui::SameLine();
    if (ImGui::Button("colour")) select(by::Colour{glm::dvec3(t.colour), double{t.tolerance}}, s);
    tip("Select by the colour without harmonics; Shift adds, Ctrl takes away");
    ImGui::TreePop();
}

/// Each button selects what may go, so that it is seen before it is deleted.
void clean_up(Session& s) {
    if (!ImGui::TreeNode("Clean up")) return;
    ToolState& t = s.tools;
    const float width = 130 * s.gui_scale;
    ImGui::TextDisabled("Each selects; look, then press Delete.");
    ImGui::SetNextItemWidth(width);
    ImGui::SliderFloat("##isolated", &t.isolated, 0.0001f, 0.5f, "below %.4f", kLogarithmic);
    tip("Share of the heaviest part, by opacity times area");
    ImGui::SameLine();
    if (ImGui::Button("isolated parts")) select(by::Isolated{double{t.isolated}}, s);
    tip("Parts that touch nothing else and are light; Shift adds, Ctrl takes away");
    ImGui::SetNextItemWidth(width / 2 - 2);
    ImGui::SliderFloat("##faint", &t.haze_opacity, 0.01f, 0.5f, "%.2f", kClamped);
    tip("Highest opacity of haze, 0 to 1");
    ImGui::SameLine(0, 4);
    ImGui::SetNextItemWidth(width / 2 - 2);
    ImGui::SliderFloat("##large", &t.haze_size, 1, 50, "%.1f x", kLogarithmic);
    tip("Least size of haze, in times of the median size");
    ImGui::SameLine();
    if (ImGui::Button("haze")) select(by::Haze{double{t.haze_opacity}, double{t.haze_size}}, s);
    tip("Splats that are large and faint; Shift adds, Ctrl takes away");
    ImGui::SetNextItemWidth(width);
    ImGui::SliderInt("##views", &t.looked_through, 1, 20, "%d photos", kClamped);
    tip("How many photos must look through a splat");
    ImGui::SameLine();
    ImGui::BeginDisabled(s.photos.views.empty());
    if (ImGui::Button("in free space")) s.ask(request::FindFreeSpace{t.looked_through});
    ImGui::EndDisabled();
    tip(s.photos.views.empty() ? "Needs the cameras of the photos"
                               : "Splats before surfaces that photos look through");
    ImGui::TreePop();
}

void select_by_region(Session& s) {
    if (!ImGui::TreeNode("Select by box or sphere")) return;
    ImGui::Checkbox("show it", &s.selection.shown);
    tip("Show the outline over the picture");
    int shape = s.selection.region.shape == Region::Shape::sphere ? 1 : 0;
    if (ImGui::Combo("shape", &shape, "box\0sphere\0"))
        s.selection.region.shape = shape == 1 ? Region::Shape::sphere : Region::Shape::box;
    tip("A box along the axes of the file, or a sphere");
    const float speed = static_cast<float>(s.scene->bounds.radius / 200);
    bool moved = edit_vector("centre", s.selection.region.centre, speed, 3);
    tip("x, y, z in units of the scene; drag, or Ctrl+click to type");
    moved |= edit_vector(shape == 1 ? "radius" : "half size", s.selection.region.half_size, speed,
                         shape == 1 ? 1 : 3);
    tip("In units of the scene; drag, or Ctrl+click to type");
    s.selection.region.half_size = glm::max(s.selection.region.half_size, glm::dvec3(1e-6));
    if (ImGui::Button("Centre on the pivot")) {
        s.selection.region.centre = s.navigation.pivot();
        moved = true;
    }
    tip("The pivot is the point that the camera turns around");
    if (moved) s.selection.shown = true;
    if (ImGui::Button("Select")) select(s.selection.region, s);
    tip("Select the splats whose centre is inside; Shift adds, Ctrl takes away");
    ImGui::SameLine();
    if (ImGui::Button("Crop to it"))
        show_edit(s.edit.remove(s.scene->model, s.selection.region, false), s);
    tip("Delete the splats whose centre is outside");
    ImGui::TreePop();
}

void format_choice(Session& s) {
    constexpr const char* kEndings[] = {".ply", ".compressed.ply", ".splat", ".spz", ".sog",
                                        ".glb"};
    if (!ImGui::BeginCombo("format", "as ...")) {
        tip("Choose a format; this changes the file's ending");
        return;
    }
    const std::string stem = stem_to_write(s.save_file);
    for (const char* ending : kEndings) {
        const std::filesystem::path other =
            std::filesystem::path(s.save_file).replace_filename(stem + ending);
        if (format_to_write(other) && ImGui::Selectable(ending)) s.save_file = other;
    }
    ImGui::EndCombo();
}

}  // namespace

void draw_region(const Session& s, int width, int height) {
    const Camera camera = camera_in_window(s.photos, s.navigation, free_area(s, width, height));
    if (s.selection.region.shape == Region::Shape::box)
        draw_box(camera, s.selection.region);
    else
        draw_sphere(camera, s.selection.region);
}

void edit_panel(Session& s) {
    if (!s.scene || !ImGui::CollapsingHeader("Edit")) return;
    ImGui::PushID("edit");
    tool_choice(s);
    selection_buttons(s);
    undo_buttons(s);
    clean_up(s);
    select_by_value(s);
    select_by_region(s);
    if (ImGui::Button("Merge a scene ...")) s.ask(request::ShowOpen{true});
    tip("Add the splats of another file to this scene as a layer, at the positions that they have "
        "there");
    ImGui::SameLine();
    if (ImGui::Button("Copy")) perform_edit(edits::Duplicate{}, s);
    tip("Add a copy of the selection as a layer");
    ImGui::SameLine();
    if (ImGui::Button("Parts")) perform_edit(edits::Select{by::Connected{}, Combine::add}, s);
    tip("Select whole parts: everything that touches the selection, or touches what does");
    path_field("file", s.save_file);
    tip("The ending of the name decides the format");
    ImGui::SameLine();
    if (ImGui::Button("Save")) s.ask(request::SaveScene{});
    tip("Save the visible layers together as one file; Ctrl+S does the same where there is one "
        "layer and no project");
    format_choice(s);
    if (ImGui::Button("Save as web page")) s.ask(request::SavePage{});
    tip("Write an .html file for any browser beside the file");
    ImGui::SameLine();
    if (ImGui::Button("Save edits as script")) s.ask(request::SaveScript{});
    tip("Write all edits beside the file, for darb edit to repeat them");
    ImGui::Checkbox("save upright", &s.save_upright);
    tip("Turn the saved scene so that up is -y, as most programs expect");
    ImGui::PopID();
}

}  // namespace darb
