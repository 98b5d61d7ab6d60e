// The sections of the side panel, each one function; and helpers that they share.
#pragma once

#include "viewer/session.h"

namespace darb {

void scene_panel(Session& session);
void display_panel(Session& session);
void camera_panel(Session& session);
void performance_panel(Session& session);
void accuracy_panel(Session& session);
void effects_panel(Session& session);
void edit_panel(Session& session);
void path_panel(Session& session);
void training_panel(Session& session);

/// The region's outline over the picture, in px of the window.
void draw_region(const Session& session, int width, int height);

/// A text field for a path.
void path_field(const char* label, std::filesystem::path& path);

}  // namespace darb
