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
#include "viewer/commands.h"
#include "viewer/guides.h"
#include "viewer/panels/panels.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr ImU32 kOutline = IM_COL32(255, 200, 60, 255);
constexpr int kCircleSteps = 64;

// The values are doubles, because far from the origin a float has no centimetres left.
bool edit_vector(const char* label, glm::dvec3& v, float speed, int components) {
    return ImGui::DragScalarN(label, ImGuiDataType_Double, &v.x, components, speed, nullptr,
                              nullptr, "%.3f");
}

void line(const Camera& camera, const glm::dvec3& a, const glm::dvec3& b) {
    const auto px = pixels_of(camera, {a, b});
    if (!px) return;
    const auto at = [](const glm::dvec2& p) {
        return ImVec2(static_cast<float>(p.x), static_cast<float>(p.y));
    };
    const ImVec2 ends[] = {at((*px)[0]), at((*px)[1])};
    outlined(*ImGui::GetBackgroundDrawList(), ends, kOutline, 1.5f);
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

void tool_settings(Session& s) {
    const Command& c = command(
        static_cast<Key>(static_cast<int>(Key::tool_navigate) + static_cast<int>(s.tools.tool)));
    ImGui::TextWrapped("%s: %s", c.name, c.tip);
    if (s.tools.tool == Tool::flood) {
        slider("colours", &s.tools.tolerance, 0, 1, "within %.2f", kClamped);
        tip("How far each channel may be from the colour of the first splat, 0 to 1");
    }
    if (s.tools.tool != Tool::brush) return;
    slider("brush", &s.tools.brush_px, 4, 300, "%.0f px", kLogarithmic);
    tip("Radius of the brush on the screen");
}

void select(const Selector& what, Session& s) {
    const ImGuiIO& io = ImGui::GetIO();
    perform_edit(edits::Select{what, io.KeyShift  ? Combine::add
                                     : io.KeyCtrl ? Combine::subtract
                                                  : Combine::replace},
                 s);
}

void grow_button(Session& s) {
    if (ImGui::Button("Grow"))
        perform_edit(edits::Select{by::Near{double{s.tools.grow}}, Combine::add}, s);
    tip("Add all splats that are nearer to a selected one than the distance on the right");
    ImGui::SameLine();
    ImGui::SetNextItemWidth(110 * s.gui_scale);
    ImGui::DragFloat("##grow", &s.tools.grow, s.tools.grow / 100, 1e-6f, 1e6f, "by %.3g units",
                     kClamped);
    tip("In units of the scene; drag, or Ctrl+click to type");
}

void selection_buttons(Session& s) {
    ImGui::Text("%s selected, %s hidden, %s deleted", count_text(s.edit.selected_count()).c_str(),
                count_text(s.edit.hidden_count()).c_str(),
                count_text(s.edit.removed_count()).c_str());
    for (const Key id : {Key::select_all, Key::select_none, Key::select_others}) {
        command_button(id, s);
        ImGui::SameLine();
    }
    ImGui::NewLine();
    grow_button(s);
    command_button(Key::hide, s);
    ImGui::SameLine();
    command_button(Key::show_hidden, s);
    for (const Key id : {Key::remove, Key::undo, Key::redo}) {
        command_button(id, s);
        ImGui::SameLine();
    }
    ImGui::NewLine();
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
    slider("##tolerance", &t.tolerance, 0, 1, "within %.2f", kClamped);
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
    slider("##isolated", &t.isolated, 0.0001f, 0.5f, "below %.4f", kLogarithmic);
    tip("Share of the heaviest part, by opacity times area");
    ImGui::SameLine();
    if (ImGui::Button("isolated parts")) select(by::Isolated{double{t.isolated}}, s);
    tip("Parts that touch nothing else and are light; Shift adds, Ctrl takes away");
    ImGui::SetNextItemWidth(width / 2 - 2);
    slider("##faint", &t.haze_opacity, 0.01f, 0.5f, "%.2f", kClamped);
    tip("Highest opacity of haze, 0 to 1");
    ImGui::SameLine(0, 4);
    ImGui::SetNextItemWidth(width / 2 - 2);
    slider("##large", &t.haze_size, 1, 50, "%.1f x", kLogarithmic);
    tip("Least size of haze, in times of the median size");
    ImGui::SameLine();
    if (ImGui::Button("haze")) select(by::Haze{double{t.haze_opacity}, double{t.haze_size}}, s);
    tip("Splats that are large and faint; Shift adds, Ctrl takes away");
    ImGui::SetNextItemWidth(width);
    slider("##views", &t.looked_through, 1, 20, "%d photos", kClamped);
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
    constexpr const char* kEndings[] = {".ply", ".compressed.ply", ".splat", ".spz", ".sog", ".glb",
                                        ".usda"};
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
    tool_settings(s);
    selection_buttons(s);
    clean_up(s);
    select_by_value(s);
    select_by_region(s);
    if (ImGui::Button("Copy")) perform_edit(edits::Duplicate{}, s);
    tip("Add a copy of the selection as a layer");
    ImGui::SameLine();
    if (ImGui::Button("Parts")) perform_edit(edits::Select{by::Connected{}, Combine::add}, s);
    tip("Select whole parts: everything that touches the selection, or touches what does");
}

void save_panel(Session& s) {
    ImGui::TextDisabled("Save as");
    ImGui::SetNextItemWidth(-FLT_MIN);
    path_field("##save", s.save_file, "The ending of the name decides the format");
    if (ImGui::Button("Save")) s.ask(request::SaveScene{});
    tip("Save the visible layers together as one file; Ctrl+S does the same where there is one "
        "layer and no project");
    ImGui::SameLine();
    ImGui::SetNextItemWidth(130 * s.gui_scale);
    format_choice(s);
    ImGui::Checkbox("save upright", &s.save_upright);
    tip("Turn the saved scene so that up is -y, as most programs expect");
    command_button(Key::save_page, s);
    if (ImGui::Button("Save edits as script")) s.ask(request::SaveScript{});
    tip("Write all edits beside the file, for darb edit to repeat them");
    command_button(Key::merge, s);
}

}  // namespace darb
