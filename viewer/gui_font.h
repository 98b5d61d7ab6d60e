// SPDX-License-Identifier: MIT
// The letters of the panels: Roboto, as the build found it in Debian's fonts-roboto-unhinted.
#pragma once

#include <span>

namespace darb {

/// A TrueType file. It is empty where the package was missing; Dear ImGui then uses its own
/// letters.
std::span<const unsigned char> gui_font();

}  // namespace darb
