// SPDX-License-Identifier: MIT
#include "viewer/swapchain.h"

#include <algorithm>

#include "engine/core/error.h"

namespace darb {

namespace {

VkSemaphore make_semaphore(VkDevice device) {
    VkSemaphoreCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
    VkSemaphore semaphore = VK_NULL_HANDLE;
    check_vulkan(vkCreateSemaphore(device, &info, nullptr, &semaphore), "window");
    return semaphore;
}

}  // namespace

Swapchain::Swapchain(Device& device, VkSurfaceKHR surface) : device_(&device), surface_(surface) {
    VkBool32 presents = VK_FALSE;
    vkGetPhysicalDeviceSurfaceSupportKHR(device.physical(), device.queue_family(), surface,
                                         &presents);
    if (presents != VK_TRUE) {
        vkDestroySurfaceKHR(device.instance(), surface_, nullptr);
        throw Error(device.info().name, "cannot show pictures in this window",
                    "Choose another device (darb devices), or use --screenshot or darb render.");
    }
    choose_format();
    for (VkSemaphore& one : acquired_) one = make_semaphore(device.handle());
}

Swapchain::~Swapchain() {
    finish_quietly(*device_);
    release_images();
    vkDestroySwapchainKHR(device_->handle(), chain_, nullptr);
    for (const VkSemaphore one : acquired_) vkDestroySemaphore(device_->handle(), one, nullptr);
    vkDestroySurfaceKHR(device_->instance(), surface_, nullptr);
}

// Values are as stored in photos, so a format that converts from linear would change them.
void Swapchain::choose_format() {
    std::uint32_t count = 0;
    vkGetPhysicalDeviceSurfaceFormatsKHR(device_->physical(), surface_, &count, nullptr);
    std::vector<VkSurfaceFormatKHR> formats(count);
    vkGetPhysicalDeviceSurfaceFormatsKHR(device_->physical(), surface_, &count, formats.data());
    if (formats.empty()) throw Error("window", "has no pixel formats");
    const auto is = [&](VkFormat wanted) {
        return std::find_if(formats.begin(), formats.end(),
                            [&](const VkSurfaceFormatKHR& f) { return f.format == wanted; });
    };
    auto best = is(kCanvasFormat);
    if (best == formats.end()) best = is(VK_FORMAT_R8G8B8A8_UNORM);
    format_ = best == formats.end() ? formats[0] : *best;
    vkGetPhysicalDeviceSurfacePresentModesKHR(device_->physical(), surface_, &count, nullptr);
    std::vector<VkPresentModeKHR> modes(count);
    vkGetPhysicalDeviceSurfacePresentModesKHR(device_->physical(), surface_, &count, modes.data());
    if (std::find(modes.begin(), modes.end(), VK_PRESENT_MODE_MAILBOX_KHR) != modes.end())
        mode_ = VK_PRESENT_MODE_MAILBOX_KHR;
}

void Swapchain::release_images() {
    for (const VkSemaphore semaphore : drawn_)
        vkDestroySemaphore(device_->handle(), semaphore, nullptr);
    drawn_.clear();
    images_.clear();
}

void Swapchain::create(int width, int height) {
    device_->wait_idle();
    VkSurfaceCapabilitiesKHR can{};
    check_vulkan(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(device_->physical(), surface_, &can),
                 "window");
    extent_ = can.currentExtent;
    if (extent_.width == 0xFFFFFFFFu)
        extent_ = {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
    stale_ = true;
    if (extent_.width == 0 || extent_.height == 0) return;  // minimised
    VkSwapchainCreateInfoKHR info{};
    info.sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR;
    info.surface = surface_;
    info.minImageCount = can.minImageCount + 1;
    if (can.maxImageCount > 0) info.minImageCount = std::min(info.minImageCount, can.maxImageCount);
    info.imageFormat = format_.format;
    info.imageColorSpace = format_.colorSpace;
    info.imageExtent = extent_;
    info.imageArrayLayers = 1;
    info.imageUsage = VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    info.preTransform = can.currentTransform;
    info.compositeAlpha = (can.supportedCompositeAlpha & VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR) != 0
                              ? VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR
                              : VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR;
    info.presentMode = mode_;
    info.clipped = VK_TRUE;
    info.oldSwapchain = chain_;
    VkSwapchainKHR next = VK_NULL_HANDLE;
    check_vulkan(vkCreateSwapchainKHR(device_->handle(), &info, nullptr, &next), "window");
    release_images();
    vkDestroySwapchainKHR(device_->handle(), chain_, nullptr);
    chain_ = next;
    std::uint32_t count = 0;
    vkGetSwapchainImagesKHR(device_->handle(), chain_, &count, nullptr);
    std::vector<VkImage> handles(count);
    vkGetSwapchainImagesKHR(device_->handle(), chain_, &count, handles.data());
    for (const VkImage image : handles) {
        images_.push_back(DeviceImage::of_another(image, static_cast<int>(extent_.width),
                                                  static_cast<int>(extent_.height),
                                                  format_.format));
        drawn_.push_back(make_semaphore(device_->handle()));
    }
    stale_ = false;
}

bool Swapchain::acquire(int width, int height, std::uint32_t& index) {
    const bool resized = extent_.width != static_cast<std::uint32_t>(width) ||
                         extent_.height != static_cast<std::uint32_t>(height);
    if (stale_ || resized) create(width, height);
    if (stale_) return false;
    const std::size_t next = (turn_ + 1) % acquired_.size();
    const VkResult result = vkAcquireNextImageKHR(device_->handle(), chain_, UINT64_MAX,
                                                  acquired_[next], VK_NULL_HANDLE, &index);
    if (result == VK_SUCCESS || result == VK_SUBOPTIMAL_KHR) turn_ = next;
    if (result == VK_SUBOPTIMAL_KHR) return true;  // shown once more; the size is checked next time
    if (result == VK_ERROR_OUT_OF_DATE_KHR) {
        stale_ = true;
        return false;
    }
    check_vulkan(result, "window");
    return true;
}

bool Swapchain::finish(Canvas& canvas, std::uint32_t index) {
    DeviceImage& target = images_[index];
    Commands& commands = canvas.commands();
    commands.copy(canvas.image(), target, VK_FILTER_NEAREST);
    commands.change_layout(target, VK_IMAGE_LAYOUT_PRESENT_SRC_KHR);
    commands.submit(acquired_[turn_], drawn_[index]);
    VkPresentInfoKHR info{};
    info.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR;
    info.waitSemaphoreCount = 1;
    info.pWaitSemaphores = &drawn_[index];
    info.swapchainCount = 1;
    info.pSwapchains = &chain_;
    info.pImageIndices = &index;
    const VkResult result = device_->present(info);
    stale_ = result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR;
    if (!stale_) check_vulkan(result, "window");
    return result != VK_ERROR_OUT_OF_DATE_KHR;
}

}  // namespace darb
