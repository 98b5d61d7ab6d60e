// SPDX-License-Identifier: MIT
// Grid, cameras, axes and colour bars over the picture, and clicks on axes and cameras.
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "shaders/shared/view_args.h"
#include "viewer/controls.h"
#include "viewer/gui.h"
#include "viewer/guides.h"
#include "viewer/panels/panels.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr std::size_t kMostCameras = 1500;  // drawn at a time
constexpr float kAxesMargin = 8;            // px at scale 1, around the axes
constexpr float kClick = 4;                 // px at scale 1 that a click may move
constexpr ImU32 kGridLine = IM_COL32(235, 240, 250, 90), kGridEdge = IM_COL32(10, 12, 15, 60);
constexpr ImU32 kShadow = IM_COL32(10, 12, 15, 150);
constexpr ImU32 kGround = IM_COL32(20, 23, 27, 225);

ImVec2 vec(const glm::dvec2& p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y)};
}

Bounds seen_bounds(const Session& s) {
    return s.scene ? Bounds(s.scene->subject) : s.run_bounds;
}

void find_ground(Session& s) {
    GuideState& g = s.guides;
    const int version = s.scene ? s.edit.model_version() : 0;
    if (g.version == version && g.up == s.navigation.up && g.scene == s.scene.get()) return;
    static const SplatModel kNone;
    g.version = version;
    g.scene = s.scene.get();
    g.up = s.navigation.up;
    g.ground = ground_height(s.scene ? s.scene->model : kNone, seen_bounds(s), g.up);
}

void draw_grid(Session& s, const Camera& camera) {
    find_ground(s);
    const double unit = s.scene ? s.edit.facts().metres_per_unit : 0;
    const GroundGrid grid = ground_grid(seen_bounds(s), s.guides.up, s.guides.ground, unit);
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    for (const Segment& line : grid.lines)  // with an edge that is seen on a light ground
        if (const auto px = pixels_of(camera, line)) {
            list.AddLine(vec((*px)[0]), vec((*px)[1]), kGridEdge, s.gui_scale + 1.5f);
            list.AddLine(vec((*px)[0]), vec((*px)[1]), kGridLine, s.gui_scale);
        }
}

void label_at_pointer(const std::string& text, float scale) {
    const ImVec2 mouse = ImGui::GetIO().MousePos, size = ImGui::CalcTextSize(text.c_str());
    const ImVec2 at(mouse.x + 14 * scale, mouse.y + 10 * scale);
    const float pad = 5 * scale;
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddRectFilled(ImVec2(at.x - pad, at.y - pad),
                       ImVec2(at.x + size.x + pad, at.y + size.y + pad), kGround, pad);
    list.AddText(at, colour_u32(theme::kText), text.c_str());
}

void draw_frustum(const Frustum& f, const Camera& camera, ImU32 colour, float width) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    for (std::size_t k = 0; k < 4; ++k)
        for (const Segment& line :
             {Segment{f.eye, f.corners[k]}, Segment{f.corners[k], f.corners[(k + 1) % 4]}})
            if (const auto px = pixels_of(camera, line)) {
                list.AddLine(vec((*px)[0]), vec((*px)[1]), kShadow, width + 2);
                list.AddLine(vec((*px)[0]), vec((*px)[1]), colour, width);
            }
}

bool clicked(float scale) {
    const ImGuiIO& io = ImGui::GetIO();
    const float most = kClick * scale;
    return ImGui::IsMouseReleased(0) && io.MouseDragMaxDistanceSqr[0] <= most * most;
}

void draw_cameras(Session& s, const Camera& camera) {
    const std::vector<View>& views = s.photos.views;
    GuideState& g = s.guides;
    if (g.cameras_measured != views.size()) {
        g.cameras_measured = views.size();
        g.camera_size = frustum_depth(views, seen_bounds(s).radius);
    }
    const bool free = !ImGui::GetIO().WantCaptureMouse && s.tools.tool == Tool::navigate;
    const ImVec2 mouse = ImGui::GetIO().MousePos;
    const int at =
        free ? camera_at(views, g.camera_size, camera, {mouse.x, mouse.y}, s.gui_scale).value_or(-1)
             : -1;
    const std::size_t step = views.size() / kMostCameras + 1;
    for (std::size_t v = 0; v < views.size(); v += step)
        if (static_cast<int>(v) != s.photos.current && at != static_cast<int>(v))
            draw_frustum(frustum_of(views[v].camera, g.camera_size), camera,
                         colour_u32(theme::kAccent), 1.3f * s.gui_scale);
    if (at < 0 || at == s.photos.current) return;
    const View& hovered = views[static_cast<std::size_t>(at)];
    draw_frustum(frustum_of(hovered.camera, g.camera_size), camera, IM_COL32(255, 225, 80, 255),
                 2.5f * s.gui_scale);
    label_at_pointer(hovered.name + (hovered.is_test ? " (held out)" : ""), s.gui_scale);
    if (clicked(s.gui_scale)) s.ask(request::ChooseCamera{at});
}

void draw_axis_balls(const std::array<AxisBall, 6>& balls, const std::optional<AxisBall>& hovered,
                     const ImVec2& centre, float scale) {
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const float radius = static_cast<float>(kAxisBall) * scale;
    list.AddCircleFilled(centre, static_cast<float>(kAxisReach + kAxisBall) * scale + 3 * scale,
                         hovered ? kGround : kShadow);
    for (const AxisBall& ball : balls) {
        const ImU32 colour = axis_colour(ball.axis);
        const ImVec2 at = vec(ball.centre);
        const bool lit =
            hovered && hovered->axis == ball.axis && hovered->positive == ball.positive;
        if (ball.positive) {
            list.AddLine(centre, at, colour, 2.5f * scale);
            list.AddCircleFilled(at, radius, colour);
            const char letter[] = {"xyz"[ball.axis], '\0'};
            const ImVec2 size = ImGui::CalcTextSize(letter);
            list.AddText(ImVec2(std::round(at.x - size.x / 2), std::round(at.y - size.y / 2)),
                         IM_COL32(15, 17, 20, 255), letter);
        } else {
            list.AddCircleFilled(at, radius, kGround);
            list.AddCircle(at, radius - scale, colour, 0, 1.5f * scale);
        }
        if (lit) list.AddCircle(at, radius + 1.5f * scale, colour_u32(theme::kText), 0, 2 * scale);
    }
}

// A window of its own, so that a click on it does not orbit.
void draw_axes(Session& s, const Camera& camera, const WindowArea& area) {
    const float scale = s.gui_scale, margin = kAxesMargin * scale;
    const float side = axes_side(s, area) - 2 * margin;
    if (side <= 0) return;
    const ImVec2 corner(static_cast<float>(area.width - area.right) - side - margin,
                        static_cast<float>(area.top) + margin);
    ImGui::SetNextWindowPos(corner);
    ImGui::SetNextWindowSize(ImVec2(side, side));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
    ImGui::Begin("axes", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoBackground |
                     ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoBringToFrontOnFocus |
                     ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoSavedSettings);
    ImGui::PopStyleVar(2);
    const bool pressed = ImGui::InvisibleButton("balls", ImVec2(side, side));
    const glm::dvec2 centre(corner.x + side / 2, corner.y + side / 2);
    const auto balls = axis_balls(camera.rotation, centre, double{scale});
    const ImVec2 mouse = ImGui::GetIO().MousePos;
    const std::optional<AxisBall> hovered =
        ImGui::IsItemHovered() ? axis_at(balls, {mouse.x, mouse.y}, double{scale}) : std::nullopt;
    draw_axis_balls(balls, hovered, vec(centre), scale);
    if (hovered) {
        tip(fmt::format("Look from {}{}", hovered->positive ? "+" : "-", "xyz"[hovered->axis])
                .c_str());
        if (pressed) {
            leave_photo(s);
            s.navigation.view_from(direction_of(*hovered));
        }
    }
    ImGui::End();
}

std::optional<ColourBar> colour_bar(const Session& s, const Camera& camera) {
    const DisplaySettings& d = s.display;
    if (d.mode == VIEW_DEPTH) {
        const double unit = s.scene ? s.edit.facts().metres_per_unit : 0;
        const auto [near_depth, far_depth] =
            depth_range(camera, s.scene ? s.scene->bounds : s.run_bounds);
        return ColourBar{"depth along the view", length_text(near_depth, unit),
                         length_text(far_depth, unit), true};
    }
    if (d.mode == VIEW_COUNT)
        return ColourBar{"splats per pixel", "0", fmt::format("{:.0f} or more", d.count_max)};
    if (d.mode == VIEW_ERROR)
        return ColourBar{"difference from the photo", "0",
                         fmt::format("{:.2g} of white", d.error_max)};
    if (s.panes.difference && !s.panes.lines.empty())
        return ColourBar{"difference from the leftmost", "0",
                         fmt::format("{:.2g} of white", s.panes.difference_max)};
    return {};
}

ImU32 heat_colour(float t) {
    static const glm::vec3 kStops[5] = {HEAT_STOPS(glm::vec3)};
    const float x = std::clamp(t, 0.0f, 1.0f) * 4;
    const auto i = std::min(static_cast<std::size_t>(x), std::size_t{3});
    const float f = x - static_cast<float>(i);
    const glm::vec3 c = glm::mix(kStops[i], kStops[i + 1], f);
    return ImGui::ColorConvertFloat4ToU32(ImVec4(c.r, c.g, c.b, 1));
}

void draw_colour_bar(const ColourBar& bar, const WindowArea& area, float scale) {
    const float width = 240 * scale, height = 12 * scale, pad = 8 * scale;
    const float line = ImGui::GetTextLineHeight(), total = 2 * line + height + 4 * pad / 2;
    const ImVec2 at(static_cast<float>(area.left) + 2 * pad,
                    static_cast<float>(area.height) - total - 2 * pad);
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddRectFilled(ImVec2(at.x - pad, at.y - pad),
                       ImVec2(at.x + width + pad, at.y + total + pad / 2), kGround, 6 * scale);
    const ImU32 text = colour_u32(theme::kText);
    list.AddText(at, text, bar.title.c_str());
    const float top = at.y + line + pad / 2;
    constexpr int kSteps = 32;
    for (int i = 0; i < kSteps; ++i) {
        const auto share = [](int k) { return static_cast<float>(k) / kSteps; };
        const auto shown = [&](int k) { return bar.light_is_low ? 1 - share(k) : share(k); };
        const ImU32 a = heat_colour(shown(i)), b = heat_colour(shown(i + 1));
        list.AddRectFilledMultiColor(ImVec2(at.x + share(i) * width, top),
                                     ImVec2(at.x + share(i + 1) * width, top + height), a, b, b, a);
    }
    const float below = top + height + pad / 2;
    list.AddText(ImVec2(at.x, below), text, bar.low.c_str());
    list.AddText(ImVec2(at.x + width - ImGui::CalcTextSize(bar.high.c_str()).x, below), text,
                 bar.high.c_str());
}

}  // namespace

float axes_side(const Session& s, const WindowArea& area) {
    const float side = 2 * (static_cast<float>(kAxisReach + kAxisBall) + 4) * s.gui_scale;
    const auto wide = static_cast<float>(area.free_width()),
               high = static_cast<float>(area.free_height());
    if (!s.guides.axes || wide < 3 * side || high < 3 * side) return 0;
    return side + 2 * kAxesMargin * s.gui_scale;
}

void draw_guides(Session& s, int width, int height) {
    if (!s.scene && !s.training.live) return;
    const WindowArea area = free_area(s, width, height);
    const Camera camera = camera_in_window(s.photos, s.navigation, area);
    if (s.guides.grid) draw_grid(s, camera);
    if (s.guides.cameras && !s.photos.views.empty()) draw_cameras(s, camera);
    if (s.guides.axes) draw_axes(s, camera, area);
    if (const std::optional<ColourBar> bar = colour_bar(s, camera))
        draw_colour_bar(*bar, area, s.gui_scale);
}

}  // namespace darb
