// SPDX-License-Identifier: MIT
// Gui: Dear ImGui on a device, with or without a window.
#pragma once

#include <vulkan/vulkan.h>
#include <array>

#include "engine/gpu/device.h"
#include "engine/report/palette.h"

struct GLFWwindow;

namespace darb {

class Gui {
  public:
    /// All coordinates, including the pointer's, are px of the picture. window: null where there is
    /// none. The render pass must outlive the Gui.
    Gui(Device& device, VkRenderPass render_pass, float scale, GLFWwindow* window);
    ~Gui();
    Gui(const Gui&) = delete;
    Gui& operator=(const Gui&) = delete;

    /// Changes the scale and draws the letters anew, sharp at the screen's pixels. Not within a
    /// frame.
    void set_scale(float scale);
    /// Starts a frame of this size, px, with the window's input.
    void begin(int width, int height);
    /// Ends the frame: what the panels drew is ready for draw().
    void end();
    void draw(VkCommandBuffer commands);

    /// Whether the panels, rather than the scene, get the pointer or the keys.
    bool wants_mouse() const;
    bool wants_keys() const;

  private:
    void start_backend();
    void upload_fonts();
    void use_pixels(int width, int height) const;
    Device* device_;
    VkRenderPass render_pass_;
    VkDescriptorPool pool_ = VK_NULL_HANDLE;
    GLFWwindow* window_;
};

/// Framebuffer px for each unit of window coordinates, in which the window system reports sizes and
/// the pointer: 2 on some high-DPI desktops, 1 on others.
float pixels_per_unit(GLFWwindow* window);

// The colours of the panels and of what is drawn over pictures, from the palette of reports and
// pages. Text has a contrast of at least 7 to 1 on every ground it stands on, and disabled text 4.5
// to 1 (WCAG 2.1, 1.4.6 and 1.4.3).

/// sRGB with alpha, 0 to 1.
using ThemeColour = std::array<float, 4>;

namespace theme {

constexpr ThemeColour theme_colour(const PaletteColour& c, float alpha = 1) {
    return {float(c.r) / 255, float(c.g) / 255, float(c.b) / 255, alpha};
}

inline constexpr ThemeColour kText = theme_colour(palette::kDark.ink);
inline constexpr ThemeColour kTextOff = theme_colour(palette::kDark.soft);
inline constexpr ThemeColour kWindow = theme_colour(palette::kDark.page);
inline constexpr ThemeColour kField = theme_colour(palette::kDark.card);
inline constexpr ThemeColour kEdge = theme_colour(palette::kDark.line);
inline constexpr ThemeColour kButton = theme_colour(palette::kButton);
inline constexpr ThemeColour kHovered = theme_colour(palette::kHovered);
inline constexpr ThemeColour kActive = theme_colour(palette::kActive);
inline constexpr ThemeColour kError = theme_colour(palette::kError);
inline constexpr ThemeColour kComplaint = theme_colour(palette::kComplaint);  // text, on kWindow
inline constexpr ThemeColour kAccent = theme_colour(palette::kAccent);
inline constexpr ThemeColour kGrab = theme_colour(palette::kGrab);  // values are written on it

/// The backgrounds on which text stands.
inline constexpr std::array kGrounds{kWindow, kField, kButton, kHovered, kActive, kError};

}  // namespace theme

/// (L1 + 0.05) / (L2 + 0.05) for the relative luminances, the lighter one first: 1 to 21.
double contrast(const ThemeColour& a, const ThemeColour& b);
/// Puts the colours, and distances at this scale, into the style of the current ImGui context.
void apply_theme(float scale);

}  // namespace darb
