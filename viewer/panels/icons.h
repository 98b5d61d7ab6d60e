// SPDX-License-Identifier: MIT
// The pictures on the buttons of the toolbar, as lines that are sharp at every scale.
#pragma once

#include <imgui.h>

#include "viewer/commands.h"

namespace darb {

/// Draws the icon into a square of this side, px, around `centre`.
void draw_icon(ImDrawList& list, Icon icon, const ImVec2& centre, float side, ImU32 colour);

}  // namespace darb
