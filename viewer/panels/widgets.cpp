// SPDX-License-Identifier: MIT
// Controls and lines that several panels share.
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <type_traits>

#include "viewer/panels/panels.h"

namespace darb {

void tip(const char* text) {
    if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
    ImGui::PushStyleVar(ImGuiStyleVar_Alpha, 1);  // also of what is grey
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(ImGui::GetFontSize() * 22);
    ImGui::TextUnformatted(text);
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
    ImGui::PopStyleVar();
}

namespace {

bool inside_a_letter(char c) {  // of UTF-8
    return (static_cast<unsigned char>(c) & 0xC0) == 0x80;
}

}  // namespace

std::string cut_text(const std::string& text, float width) {
    if (ImGui::CalcTextSize(text.c_str()).x <= width) return text;
    std::string cut = text;
    while (!cut.empty() && ImGui::CalcTextSize((cut + "...").c_str()).x > width) {
        while (!cut.empty() && inside_a_letter(cut.back())) cut.pop_back();
        if (!cut.empty()) cut.pop_back();
    }
    return cut + "...";
}

std::string cut_beginning(const std::string& text, float width) {
    if (ImGui::CalcTextSize(text.c_str()).x <= width) return text;
    std::size_t begin = 0;
    while (begin < text.size() &&
           ImGui::CalcTextSize(("..." + text.substr(begin)).c_str()).x > width)
        do ++begin;
        while (begin < text.size() && inside_a_letter(text[begin]));
    return "..." + text.substr(begin);
}

// Dear ImGui shows the beginning of what is typed. So the field is empty while nobody types, and
// the end of the path is written into it.
void path_field(const char* label, std::filesystem::path& path, const char* what) {
    char text[1024];
    const std::string now = path.string();
    std::strncpy(text, now.c_str(), sizeof text - 1);
    text[sizeof text - 1] = '\0';
    const ImGuiStyle& style = ImGui::GetStyle();
    const float width = ImGui::CalcItemWidth();
    const std::string shown = cut_beginning(now, width - 2 * style.FramePadding.x);
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const std::string name(label, std::strstr(label, "##") != nullptr
                                      ? static_cast<std::size_t>(std::strstr(label, "##") - label)
                                      : std::strlen(label));
    ImGui::BeginGroup();
    ImGui::PushID(label);
    const ImGuiID typing = ImGui::GetID("typing");
    ImGuiStorage& kept = *ImGui::GetStateStorage();
    const bool cut = shown != now && !kept.GetBool(typing);
    if (cut) ImGui::PushStyleColor(ImGuiCol_Text, ImVec4(0, 0, 0, 0));
    ImGui::SetNextItemWidth(width);
    if (ImGui::InputText("##text", text, sizeof text)) path = text;
    if (cut) ImGui::PopStyleColor();
    kept.SetBool(typing, ImGui::IsItemActive());
    if (cut && !ImGui::IsItemActive())
        ImGui::GetWindowDrawList()->AddText(
            ImVec2(at.x + style.FramePadding.x, at.y + style.FramePadding.y),
            ImGui::GetColorU32(ImGuiCol_Text), shown.c_str());
    if (!name.empty()) {
        ImGui::SameLine(0, style.ItemInnerSpacing.x);
        ImGui::TextUnformatted(name.c_str());
    }
    ImGui::PopID();
    ImGui::EndGroup();
    tip((shown != now ? what + ("\n" + now) : std::string(what)).c_str());
}

namespace {

double share_of(double value, double least, double most, bool logarithmic) {
    if (logarithmic && least > 0)
        return std::log(std::max(value, least) / least) / std::log(most / least);
    if (logarithmic && most > 0)  // as Dear ImGui has it where a scale begins at 0
        return value <= 0 ? 0 : std::clamp(1 + std::log10(value / most) / 3, 0.0, 1.0);
    return most > least ? (value - least) / (most - least) : 0;
}

// The knob of Dear ImGui would lie behind the digits.
template <class Value>
bool slider_of(const char* label, Value* value, Value least, Value most, const char* format,
               ImGuiSliderFlags flags) {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const float width = ImGui::CalcItemWidth(), height = ImGui::GetFrameHeight();
    for (const ImGuiCol knob : {ImGuiCol_SliderGrab, ImGuiCol_SliderGrabActive})
        ImGui::PushStyleColor(knob, ImVec4(0, 0, 0, 0));
    constexpr ImGuiDataType kType =
        std::is_same_v<Value, float> ? ImGuiDataType_Float : ImGuiDataType_S32;
    const bool changed = ImGui::SliderScalar(label, kType, value, &least, &most, format, flags);
    ImGui::PopStyleColor(2);
    const double share =
        std::clamp(share_of(static_cast<double>(*value), static_cast<double>(least),
                            static_cast<double>(most), (flags & ImGuiSliderFlags_Logarithmic) != 0),
                   0.0, 1.0);
    const float bar = std::max(std::round(0.13f * height), 2.0f), edge = 1;
    const float bottom = at.y + height - edge, left = at.x + edge;
    const float right = left + (width - 2 * edge) * static_cast<float>(share);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImU32 colour = ImGui::GetColorU32(ImGuiCol_CheckMark);
    list.AddRectFilled(ImVec2(left, bottom - bar), ImVec2(right, bottom), colour, bar / 2);
    const float knob = std::clamp(right, left + bar, left + width - 2 * edge - bar);
    list.AddRectFilled(ImVec2(knob - bar, bottom - 2 * bar), ImVec2(knob + bar, bottom), colour,
                       bar / 2);
    return changed;
}

}  // namespace

bool slider(const char* label, float* value, float least, float most, const char* format,
            ImGuiSliderFlags flags) {
    return slider_of(label, value, least, most, format, flags);
}

bool slider(const char* label, int* value, int least, int most, const char* format,
            ImGuiSliderFlags flags) {
    return slider_of(label, value, least, most, format, flags);
}

void outlined(ImDrawList& list, std::span<const ImVec2> line, ImU32 colour, float width,
              bool closed) {
    const ImDrawFlags flags = closed ? ImDrawFlags_Closed : ImDrawFlags_None;
    const auto count = static_cast<int>(line.size());
    list.AddPolyline(line.data(), count, IM_COL32(0, 0, 0, 190), flags, width + 2);
    list.AddPolyline(line.data(), count, colour, flags, width);
}

}  // namespace darb
