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

// The colours of the panels and of what is drawn over pictures. Text has a contrast of at least 7
// to 1 on every ground it stands on, and disabled text 4.5 to 1 (WCAG 2.1, 1.4.6 and 1.4.3).

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
inline constexpr ThemeColour kGrab{0.196f, 0.420f, 0.690f, 1};  // values are written on it

/// The backgrounds on which text stands.
inline constexpr std::array kGrounds{kWindow, kField, kButton, kHovered, kActive, kError};

}  // namespace theme

/// (L1 + 0.05) / (L2 + 0.05) for the relative luminances, the lighter one first: 1 to 21.
double contrast(const ThemeColour& a, const ThemeColour& b);
/// Puts the colours, and distances at this scale, into the style of the current ImGui context.
void apply_theme(float scale);

}  // namespace darb
