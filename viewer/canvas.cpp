// SPDX-License-Identifier: MIT
#include "viewer/canvas.h"

#include "engine/core/error.h"

namespace darb {

Canvas::Canvas(Device& device)
    : device_(&device), turns_{Turn{Commands(device), {}}, Turn{Commands(device), {}}} {
    if (!device.queue_has_graphics())
        throw Error(device.info().name, "has no graphics queue, which the window's panels need",
                    "Choose another device (darb devices), or use darb render.");
    create_render_pass();
}

Canvas::~Canvas() {
    finish_quietly(*device_);
    vkDestroyFramebuffer(device_->handle(), framebuffer_, nullptr);
    vkDestroyRenderPass(device_->handle(), render_pass_, nullptr);
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

void Canvas::begin_frame() {
    turn_ = (turn_ + 1) % turns_.size();
    commands().wait();
}

void Canvas::resize(int width, int height) {
    if (width == image_.width() && height == image_.height()) return;
    device_->wait_idle();
    vkDestroyFramebuffer(device_->handle(), framebuffer_, nullptr);
    framebuffer_ = VK_NULL_HANDLE;
    image_ = DeviceImage();
    image_ = DeviceImage(*device_, "window", width, height, kCanvasFormat,
                         VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT);
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

void Canvas::begin(const BufferPicture& picture, const glm::vec3& colour) {
    DeviceImage& unscaled = turns_[turn_].unscaled;
    commands().pass("window");
    if (picture.pixels == nullptr || !*picture.pixels || picture.width == 0) {
        commands().clear(image_, {colour.r, colour.g, colour.b, 1.0f});
    } else if (picture.width == width() && picture.height == height()) {
        commands().copy(*picture.pixels, image_);
    } else {
        // The image must be exactly as large as the picture, because a linear filter reads up to
        // its edge.
        if (unscaled.width() != picture.width || unscaled.height() != picture.height)
            unscaled =
                DeviceImage(*device_, "picture", picture.width, picture.height, kCanvasFormat);
        commands().copy(*picture.pixels, unscaled);
        commands().copy(unscaled, image_, VK_FILTER_LINEAR);
    }
    commands().change_layout(image_, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL);
    VkRenderPassBeginInfo pass{};
    pass.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO;
    pass.renderPass = render_pass_;
    pass.framebuffer = framebuffer_;
    pass.renderArea.extent = {static_cast<std::uint32_t>(width()),
                              static_cast<std::uint32_t>(height())};
    vkCmdBeginRenderPass(commands().handle(), &pass, VK_SUBPASS_CONTENTS_INLINE);
}

void Canvas::end() {
    vkCmdEndRenderPass(commands().handle());
}

ImageU8 Canvas::read_back() {
    const size_t pixels = size_t(width()) * size_t(height());
    const Buffer host(*device_, "screenshot", pixels * 4, Memory::host);
    begin_frame();
    commands().begin();
    commands().copy(image_, host);
    commands().submit_and_wait();
    ImageU8 image(width(), height(), 3);
    const auto* bgra = static_cast<const std::uint8_t*>(host.mapped());
    for (size_t p = 0; p < pixels; ++p)
        for (size_t c = 0; c < 3; ++c) image.data[p * 3 + c] = bgra[p * 4 + 2 - c];
    return image;
}

}  // namespace darb
