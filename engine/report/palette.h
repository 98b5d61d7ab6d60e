// SPDX-License-Identifier: MIT
// The colours of everything that people look at: the window, HTML reports and web pages.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace darb {

/// sRGB, 8 bits a channel.
struct PaletteColour {
    std::uint8_t r = 0, g = 0, b = 0;
};

constexpr PaletteColour palette_colour(std::uint32_t rgb) {
    return {static_cast<std::uint8_t>(rgb >> 16), static_cast<std::uint8_t>(rgb >> 8),
            static_cast<std::uint8_t>(rgb)};
}

/// "#rrggbb", as style sheets have it.
std::string css_colour(const PaletteColour& colour);

struct Palette {
    PaletteColour ink, soft;               // text, and text that matters less
    PaletteColour line;                    // edges and grid lines
    PaletteColour page, card;              // the background, and panels on it
    std::array<PaletteColour, 14> series;  // curves and legends, in their order
};

namespace palette {

inline constexpr Palette kLight{
    palette_colour(0x1c1f24),
    palette_colour(0x667080),
    palette_colour(0xdfe3e8),
    palette_colour(0xffffff),
    palette_colour(0xf6f7f9),
    {palette_colour(0x2563b0), palette_colour(0xd0571b), palette_colour(0x2a8a57),
     palette_colour(0x8650b5), palette_colour(0xb58a00), palette_colour(0x1596a8),
     palette_colour(0xb23a6b), palette_colour(0x6b7280), palette_colour(0x7a5a3a),
     palette_colour(0x4a4ac0), palette_colour(0x7fb0e0), palette_colour(0xe8a33d),
     palette_colour(0x0f5132), palette_colour(0xd88bd0)}};
/// For the window and web pages, and for reports on dark screens.
inline constexpr Palette kDark{
    palette_colour(0xeef0f3),
    palette_colour(0xbfc7d4),
    palette_colour(0x3d4551),
    palette_colour(0x14171b),
    palette_colour(0x22272e),
    {palette_colour(0x6ea8f0), palette_colour(0xf0935a), palette_colour(0x5cc48d),
     palette_colour(0xbb8ce6), palette_colour(0xe0bd4a), palette_colour(0x57cbdc),
     palette_colour(0xea7aa7), palette_colour(0xa3abb8), palette_colour(0xc49a72),
     palette_colour(0x9393f5), palette_colour(0x2f6db3), palette_colour(0xb3701a),
     palette_colour(0xb7f0cf), palette_colour(0xa04f97)}};

/// The axes x, y and z, in a gizmo and in the corner of the window.
inline constexpr std::array<PaletteColour, 3> kAxes{
    palette_colour(0xf05f5f), palette_colour(0x78cd5f), palette_colour(0x699bfa)};

// Controls on a dark background.
inline constexpr PaletteColour kAccent = kDark.series[0];
inline constexpr PaletteColour kButton = palette_colour(0x2f3742);
inline constexpr PaletteColour kHovered = palette_colour(0x2c4a74);
inline constexpr PaletteColour kActive = palette_colour(0x1f4d84);
inline constexpr PaletteColour kGrab = palette_colour(0x326bb0);
inline constexpr PaletteColour kError = palette_colour(0x7b191e);
/// Words about what was typed wrongly, on the page.
inline constexpr PaletteColour kComplaint = palette_colour(0xff9c96);

}  // namespace palette

}  // namespace darb
