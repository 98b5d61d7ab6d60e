// Canvas: the image of a window's whole content, the scene's picture with the panels drawn over
// it; then given to a swapchain or read back. Needs a queue with graphics.
#pragma once

#include <vulkan/vulkan.h>

#include "engine/core/image.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/device.h"

namespace darb {

inline constexpr VkFormat kCanvasFormat = VK_FORMAT_B8G8R8A8_UNORM;

/// An image with its memory and, where it is drawn to, its view.
class DeviceImage {
  public:
    DeviceImage() = default;
    DeviceImage(Device& device, int width, int height, VkImageUsageFlags usage);
    ~DeviceImage();
    DeviceImage(DeviceImage&&) noexcept;
    DeviceImage& operator=(DeviceImage&&) noexcept;
    VkImage handle() const { return image_; }
    VkImageView view() const { return view_; }
    int width() const { return width_; }
    int height() const { return height_; }

  private:
    void release() noexcept;
    Device* device_ = nullptr;
    VkImage image_ = VK_NULL_HANDLE;
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
    VkImageView view_ = VK_NULL_HANDLE;
    int width_ = 0, height_ = 0;
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
    VkImage image() const { return image_.handle(); }  // in TRANSFER_SRC_OPTIMAL after compose

    /// Makes it this large, in px; the picture before is lost when the size changes.
    void resize(int width, int height);

    /// Records: the picture (B8G8R8A8 of buffer, scaled to the canvas where its size differs; none
    /// where the buffer is empty: `clear`), then `draw` inside the render pass.
    template <class Draw>
    void compose(VkCommandBuffer commands, const Buffer* pixels, int width, int height,
                 const float clear[3], const Draw& draw) {
        begin(commands, pixels, width, height, clear);
        draw(commands);
        end(commands);
    }

    /// The composed image as RGB. Waits.
    ImageU8 read_back();

    /// A command buffer of the canvas's own, begun; submit_and_wait ends, runs and waits for it.
    VkCommandBuffer begin_commands();
    void submit_and_wait(VkSemaphore wait_for = VK_NULL_HANDLE,
                         VkSemaphore signal = VK_NULL_HANDLE);

  private:
    void begin(VkCommandBuffer commands, const Buffer* pixels, int width, int height,
               const float clear[3]);
    void end(VkCommandBuffer commands);
    void create_render_pass();

    Device* device_;
    VkRenderPass render_pass_ = VK_NULL_HANDLE;
    VkFramebuffer framebuffer_ = VK_NULL_HANDLE;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    VkFence fence_ = VK_NULL_HANDLE;
    DeviceImage image_, small_;
};

/// A change of an image's layout, after all before it and before all after it; all other memory is
/// ordered with it.
void image_barrier(VkCommandBuffer commands, VkImage image, VkImageLayout from, VkImageLayout to);

}  // namespace darb
