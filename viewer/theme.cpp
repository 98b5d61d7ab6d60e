#include "viewer/theme.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>

namespace darb {

namespace {

double luminance(const ThemeColour& c) {
    const auto linear = [](float v) {
        return v <= 0.04045f ? v / 12.92 : std::pow((double{v} + 0.055) / 1.055, 2.4);
    };
    return 0.2126 * linear(c[0]) + 0.7152 * linear(c[1]) + 0.0722 * linear(c[2]);
}

ImVec4 imgui_colour(const ThemeColour& c) {
    return {c[0], c[1], c[2], c[3]};
}

struct ThemeRow {
    ImGuiCol colour;
    ThemeColour value;
};

constexpr ThemeRow kThemeRows[] = {
    {ImGuiCol_Text, theme::kText},
    {ImGuiCol_TextDisabled, theme::kTextOff},
    {ImGuiCol_WindowBg, theme::kWindow},
    {ImGuiCol_PopupBg, theme::kWindow},
    {ImGuiCol_TitleBg, theme::kField},
    {ImGuiCol_TitleBgActive, theme::kField},
    {ImGuiCol_TitleBgCollapsed, theme::kField},
    {ImGuiCol_Border, theme::kEdge},
    {ImGuiCol_Separator, theme::kEdge},
    {ImGuiCol_FrameBg, theme::kField},
    {ImGuiCol_FrameBgHovered, theme::kHovered},
    {ImGuiCol_FrameBgActive, theme::kActive},
    {ImGuiCol_Button, theme::kButton},
    {ImGuiCol_ButtonHovered, theme::kHovered},
    {ImGuiCol_ButtonActive, theme::kActive},
    {ImGuiCol_Header, theme::kButton},
    {ImGuiCol_HeaderHovered, theme::kHovered},
    {ImGuiCol_HeaderActive, theme::kActive},
    {ImGuiCol_CheckMark, theme::kAccent},
    {ImGuiCol_SliderGrab, theme::kGrab},
    {ImGuiCol_SliderGrabActive, theme::kGrab},
    {ImGuiCol_PlotLines, theme::kAccent},
    {ImGuiCol_PlotHistogram, theme::kAccent},
    {ImGuiCol_ScrollbarBg, theme::kWindow},
    {ImGuiCol_ScrollbarGrab, theme::kEdge},
    {ImGuiCol_TextSelectedBg, theme::kActive},
};

}  // namespace

double contrast(const ThemeColour& a, const ThemeColour& b) {
    const double la = luminance(a), lb = luminance(b);
    return (std::max(la, lb) + 0.05) / (std::min(la, lb) + 0.05);
}

void apply_theme(float scale) {
    ImGuiStyle& style = ImGui::GetStyle();
    style = ImGuiStyle();
    ImGui::StyleColorsDark();
    for (const ThemeRow& row : kThemeRows) style.Colors[row.colour] = imgui_colour(row.value);
    style.WindowRounding = 6;
    style.FrameRounding = style.PopupRounding = style.GrabRounding = 4;
    style.WindowPadding = ImVec2(10, 10);
    style.FramePadding = ImVec2(7, 4);
    style.ItemSpacing = ImVec2(7, 6);
    style.ItemInnerSpacing = ImVec2(6, 4);
    style.ScrollbarSize = 12;
    style.WindowBorderSize = 1;
    style.ScaleAllSizes(scale);
}

}  // namespace darb
