// SPDX-License-Identifier: MIT
// The sections of the side panel, each one function; and helpers that they share.
#pragma once

#include <imgui.h>

#include "viewer/session.h"

namespace darb {

/// Ctrl+click types a value into a slider: it, too, is cut to the range.
inline constexpr ImGuiSliderFlags kClamped = ImGuiSliderFlags_AlwaysClamp;
inline constexpr ImGuiSliderFlags kLogarithmic =
    ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp;

void scene_panel(Session& session);
void display_panel(Session& session);
void camera_panel(Session& session);
void performance_panel(Session& session);
void accuracy_panel(Session& session);
void effects_panel(Session& session);
void edit_panel(Session& session);
void path_panel(Session& session);
void training_panel(Session& session);
/// All keys, where they are asked for.
void help_window(Session& session);

/// What the control before does, shown where the pointer rests on it.
void tip(const char* text);

/// Lines between panes, which can be dragged, and what each pane is; in ImGui's coordinates.
void draw_panes(Session& session);
/// The tool's stroke and gizmo.
void draw_tools(const Session& session, int width, int height);
/// What happened, for some seconds.
void draw_toasts(const Session& session);
void open_window(Session& session);
/// Which kernels are side by side.
void panes_panel(Session& session);

/// The region's outline over the picture, in ImGui's coordinates.
void draw_region(const Session& session, int width, int height);

/// A text field for a path.
void path_field(const char* label, std::filesystem::path& path);

}  // namespace darb
