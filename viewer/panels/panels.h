// SPDX-License-Identifier: MIT
// What the panels hold, one function each, and helpers that they share.
#pragma once

#include <imgui.h>

#include <span>
#include <string>

#include "engine/core/count_text.h"
#include "viewer/gui.h"
#include "viewer/input.h"
#include "viewer/session.h"

namespace darb {

/// Ctrl+click types a value into a slider; this flag limits that value to the range, too.
inline constexpr ImGuiSliderFlags kClamped = ImGuiSliderFlags_AlwaysClamp;
inline constexpr ImGuiSliderFlags kLogarithmic =
    ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp;

// What the tabs of the properties hold.
void training_panel(Session& session);
void scene_panel(Session& session);
void save_panel(Session& session);  // in the tab of the scene
void display_panel(Session& session);
void camera_panel(Session& session);
void edit_panel(Session& session);
/// The list of layers.
void layers_panel(Session& session);
void notes_panel(Session& session);
/// Labels of notes over the picture.
void draw_notes(const Session& session, int width, int height);
void mesh_panel(Session& session);
void measure_panel(Session& session);
void path_panel(Session& session);
// Folded sections for experts, in the tab of the view.
void kernel_panel(Session& session);
void accuracy_panel(Session& session);
void effects_panel(Session& session);
void performance_panel(Session& session);

/// The list of what is there, in the dock above the properties.
void draw_outliner(Session& session);
/// Menus at the top, and the column of buttons on the left.
void draw_menus(Session& session);
void draw_toolbar(Session& session, float top, float height, float room);
/// The width of the toolbar, px. It has two columns where one would make the buttons small and two
/// fit into `room`, which is what the picture can spare. height: of the toolbar.
float toolbar_width(float gui_scale, float height, float room);
/// The side of the square in the upper right corner of the picture that the axes take, with its
/// margins, px; 0 where they are not drawn.
float axes_side(const Session& session, const WindowArea& area);
/// A button of a command, with its tip.
void command_button(Key id, Session& session);
/// The photos as small pictures, in what is left of the panel; a click looks through the camera of
/// one.
void camera_thumbnails(Session& session);
/// What an empty window shows: files that were opened before, and what to do first.
void draw_splash(Session& session);
/// Grid, axes, cameras and colour bars over the picture; clicks on them.
void draw_guides(Session& session, int width, int height);
/// Lists all keys where the user asked for them.
void help_window(Session& session);

/// A colour of the theme as draw lists take it.
inline ImU32 colour_u32(const ThemeColour& c) {
    return ImGui::ColorConvertFloat4ToU32(ImVec4(c[0], c[1], c[2], c[3]));
}
inline ImU32 axis_colour(int axis) {
    return colour_u32(theme::theme_colour(palette::kAxes[static_cast<std::size_t>(axis)]));
}

/// The text, cut at its end so that it is at most this wide, px.
std::string cut_text(const std::string& text, float width);
/// The same, cut at its beginning.
std::string cut_beginning(const std::string& text, float width);
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
/// The form that begins a training run.
void train_window(Session& session);
/// Chooses which kernels are side by side.
void panes_panel(Session& session);

/// The region's outline over the picture, in ImGui's coordinates.
void draw_region(const Session& session, int width, int height);

/// A text field for a path. While nobody types, it shows the end of a path that is too long. tip:
/// what the field is for; the whole path stands below it where it is cut.
void path_field(const char* label, std::filesystem::path& path, const char* tip);

/// Sliders whose value stays readable: a bar at the lower edge of the field shows where it is.
bool slider(const char* label, float* value, float least, float most, const char* format,
            ImGuiSliderFlags flags);
bool slider(const char* label, int* value, int least, int most, const char* format,
            ImGuiSliderFlags flags);

/// A line over the picture that is seen on white and on black.
void outlined(ImDrawList& list, std::span<const ImVec2> line, ImU32 colour, float width,
              bool closed = false);

}  // namespace darb
