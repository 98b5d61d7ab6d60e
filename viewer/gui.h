// SPDX-License-Identifier: MIT
// Gui: Dear ImGui on a device, with or without a window.
#pragma once

#include <vulkan/vulkan.h>
#include <array>

#include "engine/gpu/device.h"

struct GLFWwindow;

namespace darb {

class Gui {
  public:
    /// All coordinates are px of the picture, the pointer's too. window: null where there is none.
    /// The render pass stays.
    Gui(Device& device, VkRenderPass render_pass, float scale, GLFWwindow* window);
    ~Gui();
    Gui(const Gui&) = delete;
    Gui& operator=(const Gui&) = delete;

    /// Another scale: letters are drawn anew, sharp at the screen's pixels. Not within a frame.
    void set_scale(float scale);
    /// Starts a frame of this size, px, with the input of the window.
    void begin(int width, int height);
    /// Ends it: what the panels said is ready for draw().
    void end();
    void draw(VkCommandBuffer commands);

    /// Whether the panels, not the scene, get the pointer or the keys.
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

/// Framebuffer px of one unit of a window's coordinates, in which the window system has sizes and
/// the pointer: 2 on some high-DPI desktops, 1 on others.
float pixels_per_unit(GLFWwindow* window);

// The colours of panels and of what is drawn over pictures. Text on any of its grounds has a
// contrast of at least 7 to 1, text of what is switched off 4.5 to 1 (WCAG 2.1, 1.4.6 and 1.4.3).

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
