// SPDX-License-Identifier: MIT
#include "engine/gpu/device_image.h"

#include <fmt/format.h>

#include <utility>

#include "engine/gpu/device_state.h"

namespace darb {

namespace {

VkImage create_image(const Device::State& state, VkExtent3D extent, VkFormat format,
                     VkImageUsageFlags usage, const std::string& what) {
    VkImageCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format;
    info.extent = extent;
    info.mipLevels = info.arrayLayers = 1;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.tiling = VK_IMAGE_TILING_OPTIMAL;
    info.usage = usage | VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    VkImage image = VK_NULL_HANDLE;
    check_vulkan(vkCreateImage(state.device, &info, nullptr, &image), what);
    return image;
}

VkImageView create_view(const Device::State& state, VkImage image, VkFormat format,
                        const std::string& what) {
    VkImageViewCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
    info.image = image;
    info.viewType = VK_IMAGE_VIEW_TYPE_2D;
    info.format = format;
    info.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    VkImageView view = VK_NULL_HANDLE;
    check_vulkan(vkCreateImageView(state.device, &info, nullptr, &view), what);
    return view;
}

}  // namespace

DeviceImage::DeviceImage() = default;

DeviceImage::DeviceImage(Device& device, const std::string& name, int width, int height,
                         VkFormat format, VkImageUsageFlags usage)
    : device_(&device),
      memory_(std::make_unique<MemoryPiece>()),
      format_(format),
      width_(width),
      height_(height) {
    const Device::State& state = device.state();
    const std::string what = fmt::format("image \"{}\" ({} x {})", name, width, height);
    const VkExtent3D extent{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height),
                            1};
    try {
        image_ = create_image(state, extent, format, usage, what);
        VkMemoryRequirements needs{};
        vkGetImageMemoryRequirements(state.device, image_, &needs);
        *memory_ = state.device_memory->take_own(needs, Memory::device, what);
        check_vulkan(vkBindImageMemory(state.device, image_, memory_->handle, 0), what);
        if ((usage & VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT) != 0)
            view_ = create_view(state, image_, format, what);
    } catch (...) {
        release();
        throw;
    }
    state.set_name(VK_OBJECT_TYPE_IMAGE, reinterpret_cast<std::uint64_t>(image_), name);
}

DeviceImage DeviceImage::of_another(VkImage image, int width, int height, VkFormat format) {
    DeviceImage other;
    other.image_ = image;
    other.width_ = width;
    other.height_ = height;
    other.format_ = format;
    return other;
}

DeviceImage::~DeviceImage() {
    release();
}

DeviceImage::DeviceImage(DeviceImage&& other) noexcept {
    *this = std::move(other);
}

DeviceImage& DeviceImage::operator=(DeviceImage&& other) noexcept {
    if (this == &other) return *this;
    release();
    device_ = std::exchange(other.device_, nullptr);
    image_ = std::exchange(other.image_, VK_NULL_HANDLE);
    memory_ = std::move(other.memory_);
    view_ = std::exchange(other.view_, VK_NULL_HANDLE);
    format_ = other.format_;
    width_ = std::exchange(other.width_, 0);
    height_ = std::exchange(other.height_, 0);
    layout_ = other.layout_;
    return *this;
}

void DeviceImage::release() noexcept {
    if (device_ != nullptr) {
        const VkDevice handle = device_->handle();
        vkDestroyImageView(handle, view_, nullptr);
        vkDestroyImage(handle, image_, nullptr);
        if (memory_) device_->state().device_memory->give_back(*memory_);
    }
    device_ = nullptr;
    image_ = VK_NULL_HANDLE;
    memory_.reset();
    view_ = VK_NULL_HANDLE;
    width_ = height_ = 0;
}

}  // namespace darb
