#include "viewer/canvas.h"

#include <utility>

#include "engine/core/error.h"
#include "engine/gpu/full_barrier.h"

namespace darb {

namespace {

constexpr VkImageSubresourceRange kWholeColour{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
constexpr VkImageSubresourceLayers kColourLayer{VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};

std::uint32_t device_local_type(VkPhysicalDevice physical, std::uint32_t allowed) {
    VkPhysicalDeviceMemoryProperties memory{};
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i)
        if ((allowed >> i & 1) != 0 &&
            (memory.memoryTypes[i].propertyFlags & VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT) != 0)
            return i;
    throw Error("window", "no device memory for images", "Choose another device (darb devices).");
}

VkBufferImageCopy whole_image(int width, int height) {
    VkBufferImageCopy region{};
    region.imageSubresource = kColourLayer;
    region.imageExtent = {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 1};
    return region;
}

constexpr VkImageUsageFlags kCopied =
    VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;

}  // namespace

void image_barrier(VkCommandBuffer commands, VkImage image, VkImageLayout from, VkImageLayout to) {
    const VkMemoryBarrier2 memory = full_barrier();  // of buffers that it is copied from or to
    VkImageMemoryBarrier2 barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2;
    barrier.srcStageMask = memory.srcStageMask;
    barrier.srcAccessMask = memory.srcAccessMask;
    barrier.dstStageMask = memory.dstStageMask;
    barrier.dstAccessMask = memory.dstAccessMask;
    barrier.oldLayout = from;
    barrier.newLayout = to;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = kWholeColour;
    VkDependencyInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
    info.memoryBarrierCount = 1;
    info.pMemoryBarriers = &memory;
    info.imageMemoryBarrierCount = 1;
    info.pImageMemoryBarriers = &barrier;
    vkCmdPipelineBarrier2(commands, &info);
}

DeviceImage::DeviceImage(Device& device, int width, int height, VkImageUsageFlags usage)
    : device_(&device), width_(width), height_(height) {
    VkImageCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = kCanvasFormat;
    info.extent = {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 1};
    info.mipLevels = info.arrayLayers = 1;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.tiling = VK_IMAGE_TILING_OPTIMAL;
    info.usage = usage;
    check_vulkan(vkCreateImage(device.handle(), &info, nullptr, &image_), "window image");
    VkMemoryRequirements needs{};
    vkGetImageMemoryRequirements(device.handle(), image_, &needs);
    VkMemoryAllocateInfo memory{};
    memory.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    memory.allocationSize = needs.size;
    try {
        memory.memoryTypeIndex = device_local_type(device.physical(), needs.memoryTypeBits);
        check_vulkan(vkAllocateMemory(device.handle(), &memory, nullptr, &memory_), "window image");
        check_vulkan(vkBindImageMemory(device.handle(), image_, memory_, 0), "window image");
        if ((usage & VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT) != 0) {
            VkImageViewCreateInfo view{};
            view.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
            view.image = image_;
            view.viewType = VK_IMAGE_VIEW_TYPE_2D;
            view.format = kCanvasFormat;
            view.subresourceRange = kWholeColour;
            check_vulkan(vkCreateImageView(device.handle(), &view, nullptr, &view_),
                         "window image");
        }
    } catch (...) {
        release();
        throw;
    }
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
    device_ = other.device_;
    image_ = std::exchange(other.image_, VK_NULL_HANDLE);
    memory_ = std::exchange(other.memory_, VK_NULL_HANDLE);
    view_ = std::exchange(other.view_, VK_NULL_HANDLE);
    width_ = std::exchange(other.width_, 0);
    height_ = std::exchange(other.height_, 0);
    return *this;
}

void DeviceImage::release() noexcept {
    if (device_ == nullptr) return;
    vkDestroyImageView(device_->handle(), view_, nullptr);
    vkDestroyImage(device_->handle(), image_, nullptr);
    vkFreeMemory(device_->handle(), memory_, nullptr);
    view_ = VK_NULL_HANDLE;
    image_ = VK_NULL_HANDLE;
    memory_ = VK_NULL_HANDLE;
}

Canvas::Canvas(Device& device) : device_(&device) {
    if (!device.queue_has_graphics())
        throw Error(device.info().name, "has no graphics queue, which the window's panels need",
                    "Choose another device (darb devices), or use darb render.");
    create_render_pass();
    VkCommandPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool.queueFamilyIndex = device.queue_family();
    check_vulkan(vkCreateCommandPool(device.handle(), &pool, nullptr, &pool_), "window");
    VkCommandBufferAllocateInfo buffer{};
    buffer.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    buffer.commandPool = pool_;
    buffer.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    buffer.commandBufferCount = 1;
    check_vulkan(vkAllocateCommandBuffers(device.handle(), &buffer, &commands_), "window");
    VkFenceCreateInfo fence{};
    fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    check_vulkan(vkCreateFence(device.handle(), &fence, nullptr, &fence_), "window");
}

Canvas::~Canvas() {
    const VkDevice handle = device_->handle();
    vkQueueWaitIdle(device_->queue());
    vkDestroyFence(handle, fence_, nullptr);
    vkDestroyCommandPool(handle, pool_, nullptr);
    vkDestroyFramebuffer(handle, framebuffer_, nullptr);
    vkDestroyRenderPass(handle, render_pass_, nullptr);
}

void Canvas::create_render_pass() {
    VkAttachmentDescription colour{};
    colour.format = kCanvasFormat;
    colour.samples = VK_SAMPLE_COUNT_1_BIT;
    colour.loadOp = VK_ATTACHMENT_LOAD_OP_LOAD;
    colour.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
    colour.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
    colour.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
    colour.initialLayout = colour.finalLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
    const VkAttachmentReference reference{0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
    VkSubpassDescription subpass{};
    subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
    subpass.colorAttachmentCount = 1;
    subpass.pColorAttachments = &reference;
    VkRenderPassCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO;
    info.attachmentCount = 1;
    info.pAttachments = &colour;
    info.subpassCount = 1;
    info.pSubpasses = &subpass;
    check_vulkan(vkCreateRenderPass(device_->handle(), &info, nullptr, &render_pass_), "window");
}

void Canvas::resize(int width, int height) {
    if (width == image_.width() && height == image_.height()) return;
    vkQueueWaitIdle(device_->queue());
    vkDestroyFramebuffer(device_->handle(), framebuffer_, nullptr);
    framebuffer_ = VK_NULL_HANDLE;
    image_ = DeviceImage();
    image_ = DeviceImage(*device_, width, height, kCopied | VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT);
    const VkImageView view = image_.view();
    VkFramebufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO;
    info.renderPass = render_pass_;
    info.attachmentCount = 1;
    info.pAttachments = &view;
    info.width = static_cast<std::uint32_t>(width);
    info.height = static_cast<std::uint32_t>(height);
    info.layers = 1;
    check_vulkan(vkCreateFramebuffer(device_->handle(), &info, nullptr, &framebuffer_), "window");
}

void Canvas::begin(VkCommandBuffer commands, const Buffer* pixels, int width, int height,
                   const float clear[3]) {
    image_barrier(commands, image(), VK_IMAGE_LAYOUT_UNDEFINED,
                  VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    if (pixels == nullptr || !*pixels || width == 0) {
        const VkClearColorValue colour{{clear[0], clear[1], clear[2], 1.0f}};
        vkCmdClearColorImage(commands, image(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &colour, 1,
                             &kWholeColour);
    } else if (width == this->width() && height == this->height()) {
        const VkBufferImageCopy region = whole_image(width, height);
        vkCmdCopyBufferToImage(commands, pixels->handle(), image(),
                               VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
    } else {
        // Exactly as large as the picture: a linear filter reads to the image's edge.
        if (small_.width() != width || small_.height() != height)
            small_ = DeviceImage(*device_, width, height, kCopied);
        image_barrier(commands, small_.handle(), VK_IMAGE_LAYOUT_UNDEFINED,
                      VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
        const VkBufferImageCopy region = whole_image(width, height);
        vkCmdCopyBufferToImage(commands, pixels->handle(), small_.handle(),
                               VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
        image_barrier(commands, small_.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                      VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
        VkImageBlit blit{};
        blit.srcSubresource = blit.dstSubresource = kColourLayer;
        blit.srcOffsets[1] = {width, height, 1};
        blit.dstOffsets[1] = {this->width(), this->height(), 1};
        vkCmdBlitImage(commands, small_.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, image(),
                       VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &blit, VK_FILTER_LINEAR);
    }
    image_barrier(commands, image(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                  VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL);
    VkRenderPassBeginInfo pass{};
    pass.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO;
    pass.renderPass = render_pass_;
    pass.framebuffer = framebuffer_;
    pass.renderArea.extent = {static_cast<std::uint32_t>(this->width()),
                              static_cast<std::uint32_t>(this->height())};
    vkCmdBeginRenderPass(commands, &pass, VK_SUBPASS_CONTENTS_INLINE);
}

void Canvas::end(VkCommandBuffer commands) {
    vkCmdEndRenderPass(commands);
    image_barrier(commands, image(), VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
                  VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
}

VkCommandBuffer Canvas::begin_commands() {
    check_vulkan(vkResetCommandPool(device_->handle(), pool_, 0), "window");
    VkCommandBufferBeginInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check_vulkan(vkBeginCommandBuffer(commands_, &info), "window");
    return commands_;
}

void Canvas::submit_and_wait(VkSemaphore wait_for, VkSemaphore signal) {
    check_vulkan(vkEndCommandBuffer(commands_), "window");
    check_vulkan(vkResetFences(device_->handle(), 1, &fence_), "window");
    const VkPipelineStageFlags stage = VK_PIPELINE_STAGE_ALL_COMMANDS_BIT;
    VkSubmitInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    info.commandBufferCount = 1;
    info.pCommandBuffers = &commands_;
    if (wait_for != VK_NULL_HANDLE) {
        info.waitSemaphoreCount = 1;
        info.pWaitSemaphores = &wait_for;
        info.pWaitDstStageMask = &stage;
    }
    if (signal != VK_NULL_HANDLE) {
        info.signalSemaphoreCount = 1;
        info.pSignalSemaphores = &signal;
    }
    check_vulkan(vkQueueSubmit(device_->queue(), 1, &info, fence_), "window");
    check_vulkan(vkWaitForFences(device_->handle(), 1, &fence_, VK_TRUE, UINT64_MAX), "window");
}

ImageU8 Canvas::read_back() {
    const size_t pixels = size_t(width()) * height();
    Buffer host(*device_, "screenshot", pixels * 4, Memory::host);
    const VkCommandBuffer commands = begin_commands();
    const VkBufferImageCopy region = whole_image(width(), height());
    vkCmdCopyImageToBuffer(commands, image(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, host.handle(),
                           1, &region);
    VkMemoryBarrier2 barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2;
    barrier.srcStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;
    barrier.srcAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT;
    barrier.dstStageMask = VK_PIPELINE_STAGE_2_HOST_BIT;
    barrier.dstAccessMask = VK_ACCESS_2_HOST_READ_BIT;
    VkDependencyInfo dependency{};
    dependency.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
    dependency.memoryBarrierCount = 1;
    dependency.pMemoryBarriers = &barrier;
    vkCmdPipelineBarrier2(commands, &dependency);
    submit_and_wait();
    ImageU8 image(width(), height(), 3);
    const auto* bgra = static_cast<const std::uint8_t*>(host.mapped());
    for (size_t p = 0; p < pixels; ++p)
        for (size_t c = 0; c < 3; ++c) image.data[p * 3 + c] = bgra[p * 4 + 2 - c];
    return image;
}

}  // namespace darb
