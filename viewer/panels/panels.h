// SPDX-License-Identifier: MIT
// The sections of the side panel, one function each, and helpers that they share.
#pragma once

#include <imgui.h>

#include "viewer/session.h"

namespace darb {

/// Ctrl+click types a value into a slider; this flag limits that value to the range, too.
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
/// The list of layers.
void outliner(Session& session);
void notes_panel(Session& session);
/// Labels of notes over the picture.
void draw_notes(const Session& session, int width, int height);
void mesh_panel(Session& session);
void measure_panel(Session& session);
void path_panel(Session& session);
void training_panel(Session& session);
/// Lists all keys where the user asked for them.
void help_window(Session& session);

/// Explains the control before it while the pointer rests on it.
void tip(const char* text);

/// The lines between panes, which can be dragged, and the titles of the panes, in ImGui's
/// coordinates.
void draw_panes(Session& session);
/// The tool's stroke and gizmo.
void draw_tools(const Session& session, int width, int height);
/// What is measured, over the picture.
void draw_measurement(const Session& session, int width, int height);
/// Shows messages for some seconds.
void draw_toasts(const Session& session);
void open_window(Session& session);
/// Chooses which kernels are side by side.
void panes_panel(Session& session);

/// The region's outline over the picture, in ImGui's coordinates.
void draw_region(const Session& session, int width, int height);

/// A text field for a path.
void path_field(const char* label, std::filesystem::path& path);

}  // namespace darb
