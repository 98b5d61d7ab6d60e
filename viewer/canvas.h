// SPDX-License-Identifier: MIT
// Canvas: the image of a window's whole content, which is the scene's picture with the panels drawn
// over it. It is then given to a swapchain or read back. It needs a queue with graphics.
//
// Two frames may be under way. They share the image, in the order of the queue, but each has its
// own commands and its own memory for what Dear ImGui writes.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <exception>
#include <glm/glm.hpp>

#include "engine/core/image.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/device_image.h"

namespace darb {

inline constexpr VkFormat kCanvasFormat = VK_FORMAT_B8G8R8A8_UNORM;

/// Frames that the host has given to the device and that may not be done yet.
inline constexpr int kFramesUnderWay = 2;

/// For destructors: a lost device has nothing under way, so its error is ignored.
inline void finish_quietly(const Device& device) noexcept {
    try {
        device.wait_idle();
    } catch (const std::exception&) {
    }
}

/// A picture in a buffer: B8G8R8A8 [height][width]. A null buffer means that there is no picture.
struct BufferPicture {
    const Buffer* pixels = nullptr;
    int width = 0, height = 0;  // px
};

class Canvas {
  public:
    /// Throws Error where the device's queue has no graphics.
    explicit Canvas(Device& device);
    ~Canvas();
    Canvas(const Canvas&) = delete;
    Canvas& operator=(const Canvas&) = delete;

    VkRenderPass render_pass() const { return render_pass_; }
    int width() const { return image_.width(); }
    int height() const { return image_.height(); }

    /// Begins a frame after waiting for the one before the last. From then on, what the host keeps
    /// for that frame may be used again. Throws DeviceLost.
    void begin_frame();
    /// Makes the image this large, in px; a change of size loses the picture.
    void resize(int width, int height);

    /// Starts a recording: what `first` records, then the picture, scaled to the canvas where its
    /// size differs (or this colour where there is no picture), then `draw` inside the render pass.
    /// The caller runs the commands.
    template <class First, class Draw>
    void compose(const BufferPicture& picture, const glm::vec3& colour, const First& first,
                 const Draw& draw) {
        commands().begin();
        first(commands());
        begin(picture, colour);
        draw(commands().handle());
        end();
    }
    /// What compose recorded, and what others add to it.
    Commands& commands() { return turns_[turn_].commands; }
    DeviceImage& image() { return image_; }
    void submit_and_wait() { commands().submit_and_wait(); }

    /// The composed image as RGB. Waits for the device.
    ImageU8 read_back();

  private:
    void begin(const BufferPicture& picture, const glm::vec3& colour);
    void end();
    void create_render_pass();

    Device* device_;
    VkRenderPass render_pass_ = VK_NULL_HANDLE;
    VkFramebuffer framebuffer_ = VK_NULL_HANDLE;
    struct Turn {
        Commands commands;
        DeviceImage unscaled;
    };
    std::array<Turn, kFramesUnderWay> turns_;
    std::size_t turn_ = 0;
    DeviceImage image_;
};

}  // namespace darb
