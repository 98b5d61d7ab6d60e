// Gui: Dear ImGui on a device, with or without a window.
#pragma once

#include <vulkan/vulkan.h>

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

}  // namespace darb
