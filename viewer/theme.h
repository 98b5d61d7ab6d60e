// The colours of panels and of what is drawn over pictures. Text on any of its grounds has a
// contrast of at least 7 to 1, text of what is switched off 4.5 to 1 (WCAG 2.1, 1.4.6 and 1.4.3).
#pragma once

#include <array>

namespace darb {

/// sRGB with alpha, 0 to 1.
using ThemeColour = std::array<float, 4>;

namespace theme {

inline constexpr ThemeColour kText{0.95f, 0.96f, 0.98f, 1};
inline constexpr ThemeColour kTextOff{0.75f, 0.78f, 0.83f, 1};
inline constexpr ThemeColour kWindow{0.086f, 0.094f, 0.110f, 1};
inline constexpr ThemeColour kField{0.157f, 0.173f, 0.204f, 1};
inline constexpr ThemeColour kButton{0.196f, 0.231f, 0.298f, 1};
inline constexpr ThemeColour kHovered{0.173f, 0.290f, 0.455f, 1};
inline constexpr ThemeColour kActive{0.133f, 0.318f, 0.555f, 1};
inline constexpr ThemeColour kError{0.482f, 0.098f, 0.118f, 1};
inline constexpr ThemeColour kEdge{0.310f, 0.337f, 0.392f, 1};
inline constexpr ThemeColour kAccent{0.357f, 0.659f, 1.0f, 1};
inline constexpr ThemeColour kGrab{0.196f, 0.420f, 0.690f, 1};  // values stand on it

/// Grounds that text stands on.
inline constexpr std::array kGrounds{kWindow, kField, kButton, kHovered, kActive, kError};

}  // namespace theme

/// (L1 + 0.05) / (L2 + 0.05) of the relative luminances, the lighter first: 1 to 21.
double contrast(const ThemeColour& a, const ThemeColour& b);
/// Puts them into the style of the current ImGui context, with distances at this scale.
void apply_theme(float scale);

}  // namespace darb
