// SPDX-License-Identifier: MIT
// DeviceImage: a two-dimensional colour image of the device, with its memory, its view where it is
// drawn to, and the layout that it is in, which Commands changes.
#pragma once

#include <vulkan/vulkan.h>

#include <memory>
#include <string>

#include "engine/gpu/device.h"

namespace darb {

struct MemoryPiece;  // private to engine/gpu

class DeviceImage {
  public:
    DeviceImage();
    /// The texels have 4 bytes. usage: what it is for besides copies from and to it. Its memory
    /// does not count as Device::allocated_bytes: images are a window's, and the budget is a run's.
    /// Throws NoRoom naming the image and its size.
    DeviceImage(Device& device, const std::string& name, int width, int height, VkFormat format,
                VkImageUsageFlags usage = 0);
    ~DeviceImage();
    DeviceImage(DeviceImage&&) noexcept;
    DeviceImage& operator=(DeviceImage&&) noexcept;
    /// An image that somebody else owns, such as a swapchain; what it holds is not needed.
    static DeviceImage of_another(VkImage image, int width, int height, VkFormat format);

    VkImage handle() const { return image_; }
    VkImageView view() const { return view_; }  // null where it is not drawn to
    VkFormat format() const { return format_; }
    int width() const { return width_; }
    int height() const { return height_; }
    bool same_size(const DeviceImage& other) const {
        return width_ == other.width_ && height_ == other.height_;
    }

  private:
    friend class Commands;
    void release() noexcept;
    Device* device_ = nullptr;  // null where it is not owned
    VkImage image_ = VK_NULL_HANDLE;
    std::unique_ptr<MemoryPiece> memory_;
    VkImageView view_ = VK_NULL_HANDLE;
    VkFormat format_ = VK_FORMAT_UNDEFINED;
    int width_ = 0, height_ = 0;
    VkImageLayout layout_ = VK_IMAGE_LAYOUT_UNDEFINED;  // after what is recorded
};

}  // namespace darb
