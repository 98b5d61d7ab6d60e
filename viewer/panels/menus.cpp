// SPDX-License-Identifier: MIT
// Menus and toolbar, made from the table of commands, and the page of an empty window.
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "viewer/commands.h"
#include "viewer/controls.h"
#include "viewer/panels/icons.h"
#include "viewer/panels/panels.h"

namespace darb {

namespace {

void menu_item(const Command& c, Session& s) {
    if (c.divided) ImGui::Separator();
    const bool checked = c.checked != nullptr && c.checked(s);
    const char* const key = c.keys[0] != nullptr ? c.keys[0] : "";
    if (ImGui::MenuItem(c.name, key, checked, c.enabled(s))) press(c.id, s);
    tip(c.tip);
}

// px at scale 1; where one column would make buttons smaller than kSmall, there are two
constexpr float kButton = 34, kSmall = 27, kLeastButton = 16, kGap = 3, kInset = 5;

// What the toolbar has, and where it has a line between groups.
constexpr std::array kTools{
    Key::tool_navigate, Key::tool_rectangle, Key::tool_lasso,   Key::tool_polygon,
    Key::tool_brush,    Key::tool_sphere,    Key::tool_flood,   Key::tool_move,
    Key::tool_turn,     Key::tool_scale,     Key::tool_measure, Key::compare,
    Key::show_cameras,  Key::show_grid,      Key::play,         Key::undo,
    Key::redo};
constexpr std::array kGroupBegins{Key::tool_rectangle, Key::tool_move, Key::tool_measure,
                                  Key::compare, Key::play};

bool begins_group(Key id) {
    return std::ranges::find(kGroupBegins, id) != kGroupBegins.end();
}

// The rows of the toolbar: as many buttons in each as there are columns, and each group begins one.
std::vector<std::vector<Key>> tool_rows(int columns) {
    std::vector<std::vector<Key>> rows;
    for (const Key id : kTools) {
        const bool full = rows.empty() || rows.back().size() == static_cast<std::size_t>(columns);
        if (full || begins_group(id)) rows.emplace_back();
        rows.back().push_back(id);
    }
    return rows;
}

// The side of a button where there are so many columns, px.
float button_side(int columns, float scale, float height) {
    const auto rows = static_cast<float>(tool_rows(columns).size());
    const float gaps = kGap * scale * (rows + 3 * static_cast<float>(kGroupBegins.size()));
    const float room = (height - 2 * kInset * scale - gaps) / rows;
    return std::max(1.0f, std::floor(std::clamp(room, kLeastButton * scale, kButton * scale)));
}

float columns_width(int columns, float scale) {
    const auto n = static_cast<float>(columns);
    return std::round((n * kButton + (n - 1) * kGap + 2 * kInset) * scale);
}

int tool_columns(float scale, float height, float room) {
    const bool small = button_side(1, scale, height) < kSmall * scale;
    return small && columns_width(2, scale) <= room ? 2 : 1;
}

void tool_button(const Command& c, float side, Session& s) {
    const ImVec2 at = ImGui::GetCursorScreenPos(), end(at.x + side, at.y + side);
    const bool enabled = c.enabled(s), on = c.checked != nullptr && c.checked(s);
    ImGui::BeginDisabled(!enabled);
    if (ImGui::InvisibleButton(c.name, ImVec2(side, side))) press(c.id, s);
    const bool hovered = ImGui::IsItemHovered(), held = ImGui::IsItemActive();
    ImGui::EndDisabled();
    tip(command_tip(c).c_str());
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const float round = 5 * s.gui_scale;
    if (on || hovered)
        list.AddRectFilled(
            at, end,
            ImGui::GetColorU32(on || held ? ImGuiCol_ButtonActive : ImGuiCol_ButtonHovered), round);
    const ImU32 colour = ImGui::GetColorU32(ImGuiCol_Text, enabled ? 1.0f : 0.35f);
    draw_icon(list, c.icon, ImVec2(at.x + side / 2, at.y + side / 2), 0.56f * side, colour);
}

}  // namespace

void command_button(Key id, Session& s) {
    const Command& c = command(id);
    ImGui::BeginDisabled(!c.enabled(s));
    if (ImGui::Button(c.name)) press(id, s);
    ImGui::EndDisabled();
    tip(command_tip(c).c_str());
}

void draw_menus(Session& s) {
    if (!ImGui::BeginMainMenuBar()) return;
    for (std::size_t m = 0; m < kMenuNames.size(); ++m) {
        if (!ImGui::BeginMenu(kMenuNames[m])) continue;
        for (const Command& c : commands())
            if (c.menu == static_cast<Menu>(m)) menu_item(c, s);
        if (s.close_menus) ImGui::CloseCurrentPopup();
        ImGui::EndMenu();
    }
    const std::string title = cut_text(s.title, ImGui::GetContentRegionAvail().x);
    ImGui::SetCursorPosX(ImGui::GetWindowWidth() - ImGui::CalcTextSize(title.c_str()).x -
                         12 * s.gui_scale);
    ImGui::TextDisabled("%s", title.c_str());
    ImGui::EndMainMenuBar();
    s.close_menus = false;
}

float toolbar_width(float scale, float height, float room) {
    return columns_width(tool_columns(scale, height, room), scale);
}

void draw_toolbar(Session& s, float top, float height, float room) {
    const float scale = s.gui_scale, edge = kInset * scale, gap = kGap * scale;
    const int columns = tool_columns(scale, height - top, room);
    const float side = button_side(columns, scale, height - top);
    const float width = columns_width(columns, scale), inside = width - 2 * edge;
    ImGui::SetNextWindowPos(ImVec2(0, top));
    ImGui::SetNextWindowSize(ImVec2(width, std::max(height - top, 1.0f)));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(edge, edge));
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(0, kGap * scale));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
    ImGui::Begin("toolbar", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoSavedSettings);
    ImGui::PopStyleVar(3);
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(0, kGap * scale));
    const float row_width = static_cast<float>(columns) * (side + gap) - gap;
    const float left = std::floor((inside - row_width) / 2);
    for (const std::vector<Key>& row : tool_rows(columns)) {
        if (begins_group(row.front())) {
            const ImVec2 at = ImGui::GetCursorScreenPos();
            ImGui::Dummy(ImVec2(1, gap));
            ImGui::GetWindowDrawList()->AddLine(ImVec2(at.x, at.y + gap / 2),
                                                ImVec2(at.x + inside, at.y + gap / 2),
                                                ImGui::GetColorU32(ImGuiCol_Separator));
        }
        ImGui::SetCursorPosX(ImGui::GetCursorPosX() + left);
        for (const Key id : row) {
            if (id != row.front()) ImGui::SameLine(0, gap);
            tool_button(command(id), side, s);
        }
    }
    ImGui::PopStyleVar();
    ImGui::End();
}

// The page of an empty window.

namespace {

constexpr HeldRow kFirst[] = {
    {"Make a scene of photos", "darb train PHOTOS -o OUT --view"},
    {"Watch it, then open it again", "darb view OUT"},
    {"Put it on a web page", "darb convert OUT scene.html"},
};

void recent_files(Session& s) {
    constexpr std::size_t kShown = 6;
    const std::vector<std::filesystem::path>& recent = s.open_dialog.recent;
    if (recent.empty()) return;
    ImGui::Spacing();
    ImGui::TextDisabled("Opened before");
    const float room = ImGui::GetContentRegionAvail().x;
    for (std::size_t i = 0; i < std::min(recent.size(), kShown); ++i) {
        const std::filesystem::path file = recent[i];
        ImGui::PushID(static_cast<int>(i));
        const std::string name = cut_text(file.filename().string(), 0.45f * room);
        if (ImGui::Selectable(name.c_str())) s.ask(request::Open{file, false});
        tip(file.string().c_str());
        ImGui::SameLine(0.48f * room);
        ImGui::TextDisabled("%s", cut_text(file.parent_path().string(), 0.5f * room).c_str());
        ImGui::PopID();
    }
}

}  // namespace

void draw_splash(Session& s) {
    if (s.scene || s.training.live || s.progress.load >= 0 || s.open_dialog.shown || s.leaving ||
        s.train_form.shown)
        return;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const WindowArea area = free_area(s, static_cast<int>(size.x), static_cast<int>(size.y));
    const float width =
        std::min(460 * s.gui_scale, static_cast<float>(area.free_width()) - 16 * s.gui_scale);
    ImGui::SetNextWindowPos(
        ImVec2(static_cast<float>(area.left) + static_cast<float>(area.free_width()) / 2,
               static_cast<float>(area.top) + static_cast<float>(area.free_height()) / 2),
        0, ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSize(ImVec2(std::max(width, 1.0f), 0));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(20 * s.gui_scale, 18 * s.gui_scale));
    ImGui::Begin("Welcome", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::PopStyleVar();
    ImGui::SetWindowFontScale(1.5f);
    ImGui::TextUnformatted("darb");
    ImGui::SetWindowFontScale(1);
    ImGui::TextWrapped(s.train_form.offered()
                           ? "Drop a scene of splats, a point cloud, a mesh, a folder of photos or "
                             "a video on this window."
                           : "Drop a scene of splats, a point cloud or a mesh on this window.");
    ImGui::Spacing();
    command_button(Key::open, s);
    ImGui::SameLine();
    if (s.train_form.offered()) {
        command_button(Key::train, s);
        ImGui::SameLine();
    }
    command_button(Key::help, s);
    recent_files(s);
    ImGui::Spacing();
    ImGui::TextDisabled("The same in a terminal");
    for (const HeldRow& row : kFirst) {
        ImGui::TextWrapped("%s:", row.input);
        ImGui::Indent();
        ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_CheckMark));
        ImGui::TextWrapped("%s", row.does);
        ImGui::PopStyleColor();
        ImGui::Unindent();
    }
    ImGui::End();
}

}  // namespace darb
