// SPDX-License-Identifier: MIT
// A training run that is followed: how far it is, its curves, what can be asked of it, and the
// photos as small pictures.
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <string>
#include <vector>

#include "viewer/commands.h"
#include "viewer/controls.h"
#include "viewer/panels/panels.h"

namespace darb {

namespace {

constexpr float kPlotHeight = 96, kCurveHeight = 40;  // px at scale 1
constexpr float kPointRadius = 3;

std::string time_text(double seconds) {
    const auto whole = static_cast<long>(seconds + 0.5);
    if (whole < 60) return fmt::format("{} s", whole);
    if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
    return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string count_of(double number) {
    return number < 1e6 ? count_text(static_cast<std::uint64_t>(number))
                        : fmt::format("{:.2f} M", number / 1e6);
}

void card(const char* name, const std::string& value) {
    ImGui::TableNextColumn();
    ImGui::TextDisabled("%s", name);
    ImGui::TextUnformatted(value.c_str());
}

void how_far(const TrainingCurves& t) {
    const float share = t.last_iteration > 0
                            ? static_cast<float>(t.iteration) / static_cast<float>(t.last_iteration)
                            : 0;
    ImGui::ProgressBar(
        share, ImVec2(-FLT_MIN, 0),
        fmt::format("iteration {} of {}", count_text(static_cast<std::uint64_t>(t.iteration)),
                    count_text(static_cast<std::uint64_t>(t.last_iteration)))
            .c_str());
    if (!ImGui::BeginTable("cards", 3)) return;
    card("time left", t.finished           ? "finished"
                      : t.paused           ? "paused"
                      : t.seconds_left > 0 ? time_text(t.seconds_left)
                                           : "not known yet");
    card("splats", t.splats.empty() ? "-" : count_of(double{t.splats.back()}));
    card("device memory", fmt::format("{:.0f} MiB", double(t.memory_bytes) / 1024 / 1024));
    ImGui::EndTable();
}

// Held-out PSNR over the iterations of the run, the only honest measure of how good it is.
void held_out_plot(const TrainingCurves& t, float scale) {
    const ImVec2 size(ImGui::GetContentRegionAvail().x, kPlotHeight * scale);
    const ImVec2 at = ImGui::GetCursorScreenPos();
    ImGui::Dummy(size);
    const bool hovered = ImGui::IsItemHovered();
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.AddRectFilled(at, ImVec2(at.x + size.x, at.y + size.y),
                       ImGui::GetColorU32(ImGuiCol_FrameBg), 4 * scale);
    const std::size_t count = std::min(t.held_out_psnr_db.size(), t.held_out_at.size());
    const float pad = 6 * scale, line = ImGui::GetTextLineHeight();
    const std::string title = count == 0 ? "PSNR of held-out photos: not measured yet"
                                         : fmt::format("PSNR of held-out photos: {:.2f} dB",
                                                       double{t.held_out_psnr_db[count - 1]});
    list.AddText(ImVec2(at.x + pad, at.y + pad / 2), ImGui::GetColorU32(ImGuiCol_Text),
                 title.c_str());
    if (count == 0) return;
    const auto [least, most] = std::minmax_element(
        t.held_out_psnr_db.begin(), t.held_out_psnr_db.begin() + std::ptrdiff_t(count));
    const float low = std::floor(*least - 0.5f), high = std::ceil(*most + 0.5f);
    const float left = at.x + pad + ImGui::CalcTextSize("00").x + pad,
                right = at.x + size.x - 2 * pad;
    const float top = at.y + 1.5f * line + pad, bottom = at.y + size.y - pad;
    for (const float value : {low, high}) {
        const float y = value == low ? bottom : top;
        list.AddLine(ImVec2(left, y), ImVec2(right, y), ImGui::GetColorU32(ImGuiCol_Separator));
        const std::string text = fmt::format("{:.0f}", double{value});
        list.AddText(ImVec2(at.x + pad, std::min(y - line / 2, at.y + size.y - line)),
                     ImGui::GetColorU32(ImGuiCol_TextDisabled), text.c_str());
    }
    std::vector<ImVec2> points;
    for (std::size_t i = 0; i < count; ++i)
        points.emplace_back(left + (right - left) * static_cast<float>(t.held_out_at[i]) /
                                       static_cast<float>(std::max(t.last_iteration, 1)),
                            bottom - (bottom - top) * (t.held_out_psnr_db[i] - low) / (high - low));
    const ImU32 colour = ImGui::GetColorU32(ImGuiCol_PlotLines);
    list.AddPolyline(points.data(), static_cast<int>(count), colour, 0, 2 * scale);
    for (std::size_t i = 0; i < count; ++i) {
        list.AddCircleFilled(points[i], kPointRadius * scale, colour);
        if (hovered && std::abs(ImGui::GetIO().MousePos.x - points[i].x) < 6 * scale)
            ImGui::SetTooltip("iteration %d: %.2f dB", t.held_out_at[i],
                              double{t.held_out_psnr_db[i]});
    }
}

void curve(const char* label, const std::vector<float>& values, const char* format, float scale) {
    if (values.empty()) return;
    const std::string text =
        fmt::format(fmt::runtime(std::string("{}: ") + format), label, double{values.back()});
    ImGui::PushID(label);
    ImGui::PlotLines("", values.data(), static_cast<int>(values.size()), 0, text.c_str(), FLT_MAX,
                     FLT_MAX, ImVec2(ImGui::GetContentRegionAvail().x, kCurveHeight * scale));
    ImGui::PopID();
}

void run_buttons(Session& s) {
    TrainingCurves& t = s.training;
    const auto ask = [&](RunWish wish) { s.ask(request::AskRun{std::move(wish)}); };
    if (ImGui::Button(t.paused ? "Continue" : "Pause")) press(Key::play, s);
    tip("Pause or continue the training (Space)");
    ImGui::SameLine();
    if (ImGui::Button("Step")) press(Key::step, s);
    tip("Train one iteration, then pause (.)");
    ImGui::SameLine();
    if (ImGui::Button("Measure now")) ask({.measures = true});
    tip("Measure PSNR and SSIM of the held-out photos after this iteration; it is no training "
        "time");
    ImGui::SameLine();
    if (ImGui::Button("Save now")) ask({.saves = true});
    tip("Write the checkpoint and the scene as it is now, and go on");
    if (s.run_desk.stopped) {
        ImGui::TextDisabled("The run ends after this iteration ...");
        return;
    }
    if (!s.run_desk.stopping) {
        if (ImGui::Button("Stop and publish ...")) s.run_desk.stopping = true;
        tip("End the run here; it can be resumed later");
        return;
    }
    const auto stop = [&](bool publishes) {
        ask({.stops = true, .publishes = publishes});
        s.run_desk.stopped = true;
    };
    if (ImGui::Button("Scene and web page")) stop(true);
    tip("End the run, save its scene and write scene.html beside it");
    ImGui::SameLine();
    if (ImGui::Button("Scene")) stop(false);
    tip("End the run and save its scene");
    ImGui::SameLine();
    if (ImGui::Button("Train on")) s.run_desk.stopping = false;
    tip("Do not stop");
}

void run_settings(Session& s) {
    if (!ImGui::CollapsingHeader("Change the run")) return;
    const RunSettings now = s.training.settings;
    RunSettings typed = s.run_desk.typed.value_or(now);
    ImGui::InputInt("iterations", &typed.iterations, 0);
    tip("Length of the whole run. Learning rates follow the new length from here on; not possible "
        "once the mean of the last iterations has begun");
    int splats = static_cast<int>(std::min<std::uint32_t>(typed.max_splats, 2'000'000'000u));
    ImGui::InputInt("most splats", &splats, 0);
    tip("Growth stops there; 0: as it is. Splats that are there stay");
    ImGui::InputDouble("memory, MiB", &typed.max_memory_mib, 0, 0, "%.0f");
    tip("Device memory before which growth stops; 0: no limit");
    typed.iterations = std::max(typed.iterations, 1);
    typed.max_splats = static_cast<std::uint32_t>(std::max(splats, 0));
    typed.max_memory_mib = std::max(typed.max_memory_mib, 0.0);
    s.run_desk.typed = typed == now ? std::nullopt : std::optional(typed);
    ImGui::BeginDisabled(!s.run_desk.typed);
    if (ImGui::Button("Apply")) {
        s.ask(request::AskRun{{.change = typed}});
        s.run_desk.typed.reset();
    }
    tip("Change the run after this iteration; log, report and --resume know it");
    ImGui::SameLine();
    if (ImGui::Button("Discard")) s.run_desk.typed.reset();
    ImGui::EndDisabled();
    ImGui::TextDisabled("Kernel, effects and strategy stay as they began.");
}

}  // namespace

void training_panel(Session& s) {
    TrainingCurves& t = s.training;
    how_far(t);
    if (!t.finished) run_buttons(s);
    held_out_plot(t, s.gui_scale);
    if (!t.finished) run_settings(s);
    if (ImGui::CollapsingHeader("Curves")) {
        curve("loss", t.loss, "{:.4f}", s.gui_scale);
        curve("PSNR of the photos it trains on", t.psnr_db, "{:.2f} dB", s.gui_scale);
        curve("splats", t.splats, "{:.0f}", s.gui_scale);
    }
    if (!s.photos.views.empty()) {
        ImGui::Separator();
        ImGui::TextDisabled("Look through a photo's camera");
        camera_thumbnails(s);
    }
}

// The photos as small pictures.

namespace {

constexpr int kThumbColumns = 4, kNameColumns = 2;
constexpr float kLeastThumbs = 120;  // px at scale 1: height of the list
constexpr float kThumbGap = 4;       // px at scale 1

// A vertex a pixel, so that colours run smoothly into each other; it needs no texture.
void draw_pixels(ImDrawList& list, const Thumbnail& t, const ImVec2& at, const ImVec2& size) {
    const int w = t.width, h = t.height;
    if (w < 2 || h < 2) return;
    list.PrimReserve((w - 1) * (h - 1) * 6, w * h);
    const ImVec2 uv = ImGui::GetFontTexUvWhitePixel();
    const unsigned base = list._VtxCurrentIdx;
    for (int y = 0; y + 1 < h; ++y)
        for (int x = 0; x + 1 < w; ++x) {
            const unsigned a = base + static_cast<unsigned>(y * w + x);
            const unsigned below = a + static_cast<unsigned>(w);
            for (const unsigned v : {a, a + 1, below + 1, a, below + 1, below})
                list.PrimWriteIdx(static_cast<ImDrawIdx>(v));
        }
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
            list.PrimWriteVtx(
                ImVec2(at.x + size.x * static_cast<float>(x) / static_cast<float>(w - 1),
                       at.y + size.y * static_cast<float>(y) / static_cast<float>(h - 1)),
                uv, t.pixels[static_cast<std::size_t>(y * w + x)]);
}

void thumbnail_button(Session& s, std::size_t v, const ImVec2& box) {
    const View& view = s.photos.views[v];
    const ImVec2 at = ImGui::GetCursorScreenPos();
    ImGui::PushID(static_cast<int>(v));
    if (ImGui::InvisibleButton("photo", box)) s.ask(request::ChooseCamera{static_cast<int>(v)});
    const bool hovered = ImGui::IsItemHovered();
    tip((view.name + (view.is_test ? "\nheld out: the run does not train on it" : "")).c_str());
    ImGui::PopID();
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImVec2 end(at.x + box.x, at.y + box.y);
    list.AddRectFilled(at, end, ImGui::GetColorU32(ImGuiCol_FrameBg));
    const auto thumbnail = ImGui::IsItemVisible() ? s.thumbnails->get(v, view) : nullptr;
    if (thumbnail && thumbnail->width > 0) {
        const float fit = std::min(box.x / static_cast<float>(thumbnail->width),
                                   box.y / static_cast<float>(thumbnail->height));
        const ImVec2 size(fit * static_cast<float>(thumbnail->width),
                          fit * static_cast<float>(thumbnail->height));
        draw_pixels(list, *thumbnail,
                    ImVec2(at.x + (box.x - size.x) / 2, at.y + (box.y - size.y) / 2), size);
    } else {
        const std::string name = cut_text(view.name, box.x - 6 * s.gui_scale);
        list.AddText(ImVec2(at.x + 3 * s.gui_scale, at.y + 3 * s.gui_scale),
                     ImGui::GetColorU32(ImGuiCol_TextDisabled), name.c_str());
    }
    const bool current = s.photos.current == static_cast<int>(v);
    if (current || hovered)
        list.AddRect(at, end, ImGui::GetColorU32(current ? ImGuiCol_CheckMark : ImGuiCol_Text), 0,
                     0, (current ? 2.5f : 1.5f) * s.gui_scale);
}

}  // namespace

void camera_thumbnails(Session& s) {
    if (!s.thumbnails) s.thumbnails = std::make_unique<Thumbnails>(s.wake);
    ImGui::BeginChild("thumbnails", ImVec2(0, std::max(ImGui::GetContentRegionAvail().y,
                                                       kLeastThumbs * s.gui_scale)));
    const float gap = kThumbGap * s.gui_scale;
    // Cameras whose photos nobody knows are a list of names.
    const bool photos =
        std::ranges::any_of(s.photos.views, [](const View& view) { return !view.photo.empty(); });
    const int columns = photos ? kThumbColumns : kNameColumns;
    const float side =
        std::floor((ImGui::GetContentRegionAvail().x - static_cast<float>(columns - 1) * gap) /
                   static_cast<float>(columns));
    const ImVec2 box(side, photos ? 0.75f * side : ImGui::GetTextLineHeight() + 6 * s.gui_scale);
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(gap, gap));
    const int rows = (static_cast<int>(s.photos.views.size()) + columns - 1) / columns;
    ImGuiListClipper clipper;
    clipper.Begin(rows, box.y + gap);
    while (clipper.Step())
        for (int row = clipper.DisplayStart; row < clipper.DisplayEnd; ++row)
            for (int column = 0; column < columns; ++column) {
                const auto v = static_cast<std::size_t>(row * columns + column);
                if (v >= s.photos.views.size()) break;
                if (column > 0) ImGui::SameLine();
                thumbnail_button(s, v, box);
            }
    clipper.End();
    ImGui::PopStyleVar();
    ImGui::EndChild();
}

}  // namespace darb
