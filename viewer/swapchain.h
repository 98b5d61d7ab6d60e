// SPDX-License-Identifier: MIT
// Swapchain: presents a canvas on a window's surface.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <vector>

#include "engine/gpu/device.h"
#include "viewer/canvas.h"

namespace darb {

class Swapchain {
  public:
    /// Takes ownership of the surface. Throws Error where the device cannot present to it.
    Swapchain(Device& device, VkSurfaceKHR surface);
    ~Swapchain();
    Swapchain(const Swapchain&) = delete;
    Swapchain& operator=(const Swapchain&) = delete;

    /// Copies the composed canvas into the next image and presents it, without waiting for the
    /// device. compose records the canvas and is called once there is an image. Returns false where
    /// nothing is shown, because the window has just changed its size or has none; the next call
    /// makes a new chain.
    template <class Compose>
    bool present(Canvas& canvas, const Compose& compose) {
        std::uint32_t index = 0;
        if (!acquire(canvas.width(), canvas.height(), index)) return false;
        compose();
        return finish(canvas, index);
    }

  private:
    bool acquire(int width, int height, std::uint32_t& index);
    bool finish(Canvas& canvas, std::uint32_t index);
    void choose_format();
    void create(int width, int height);
    void release_images();

    Device* device_;
    VkSurfaceKHR surface_;
    VkSurfaceFormatKHR format_{};
    VkPresentModeKHR mode_ = VK_PRESENT_MODE_FIFO_KHR;
    VkSwapchainKHR chain_ = VK_NULL_HANDLE;
    std::vector<DeviceImage> images_;
    std::vector<VkSemaphore> drawn_;                       // one for each image
    std::array<VkSemaphore, kFramesUnderWay> acquired_{};  // one for each frame under way
    std::size_t turn_ = 0;
    VkExtent2D extent_{};
    bool stale_ = true;
};

}  // namespace darb
