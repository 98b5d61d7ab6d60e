// SPDX-License-Identifier: MIT
#include "engine/gpu/buffer.h"

#include <fmt/format.h>
#include <algorithm>
#include <cstring>
#include <functional>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/gpu/barriers.h"
#include "engine/gpu/device_state.h"

namespace darb {

namespace {

constexpr std::uint64_t kStagingBytes = 32 << 20;  // long copies go in pieces of this size

std::string describe(const std::string& name, std::uint64_t bytes) {
    return fmt::format("buffer \"{}\" ({:.1f} MiB)", name, static_cast<double>(bytes) / (1 << 20));
}

[[noreturn]] void throw_outside(const std::string& name, std::uint64_t offset, std::uint64_t bytes,
                                std::uint64_t whole) {
    throw Error(name, fmt::format("bytes {} + {} of {} are asked for", offset, bytes, whole),
                "Stay within the buffer.");
}

VkBuffer create_handle(const Device::State& state, std::uint64_t bytes, const std::string& what) {
    VkBufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    info.size = bytes;
    info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
                 VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    info.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
    VkBuffer buffer = VK_NULL_HANDLE;
    check_vulkan(vkCreateBuffer(state.device, &info, nullptr, &buffer), what);
    return buffer;
}

// charged: of these bytes, what counts as the device's.
void check_limits(const Device::State& state, const std::string& name, std::uint64_t bytes,
                  std::uint64_t charged, const std::string& what) {
    const std::uint64_t limit = state.info.max_allocation_bytes;
    if (bytes > limit)
        throw NoRoom(
            what, fmt::format("{} allows at most {} MiB a buffer", state.info.name, limit >> 20),
            "Use smaller images or fewer splats, or choose another device (darb devices).");
    const std::uint64_t budget = state.budget, in_use = state.allocated;
    if (budget != 0 && charged != 0 && in_use + charged > budget)
        throw NoRoom(
            what,
            fmt::format("out of device memory: {:.1f} MiB are in use of a budget of {:.1f}",
                        static_cast<double>(in_use) / (1 << 20),
                        static_cast<double>(budget) / (1 << 20)),
            "Raise the memory budget (--max-memory), or use smaller images or fewer splats.");
    if (state.faults.fails_allocation(name, charged == 0 ? 0 : in_use + charged))
        check_vulkan(VK_ERROR_OUT_OF_DEVICE_MEMORY, what);
}

// What a copy of so many bytes goes through where the host cannot map the buffer: memory of the
// host.
Buffer staging_for(Device& device, std::uint64_t bytes) {
    return Buffer(device, "staging", std::min(kStagingBytes, bytes), Memory::waiting);
}

}  // namespace

Buffer::Buffer() = default;

Buffer::Buffer(Device& device, std::string name, std::uint64_t bytes, Memory kind,
               std::string_view pass)
    : device_(&device),
      name_(std::move(name)),
      memory_(std::make_unique<MemoryPiece>()),
      bytes_(bytes == 0 ? 16 : bytes) {
    Device::State& state = device.state();
    const std::string what =
        (pass.empty() ? "" : fmt::format("pass {}, ", pass)) + describe(name_, bytes_);
    // Copies and fills work on words.
    const std::uint64_t whole_words = charged_bytes(bytes);
    const std::uint64_t charged = kind == Memory::waiting ? 0 : whole_words;
    check_limits(state, name_, whole_words, charged, what);
    try {
        buffer_ = create_handle(state, whole_words, what);
        VkMemoryRequirements needs{};
        vkGetBufferMemoryRequirements(state.device, buffer_, &needs);
        *memory_ = state.device_memory->take(needs, kind, what);
        check_vulkan(vkBindBufferMemory(state.device, buffer_, memory_->handle, memory_->offset),
                     what);
        const bool shared = state.info.unified_memory && (memory_->flags & kCached) != 0;
        if (kind != Memory::device || shared) direct_ = memory_->mapped;
        if (kind != Memory::device) mapped_ = direct_;
    } catch (...) {
        release();
        throw;
    }
    allocated_ = charged;
    const std::uint64_t now = state.allocated += allocated_;
    if (now > state.peak) state.peak = now;
    state.set_name(VK_OBJECT_TYPE_BUFFER, reinterpret_cast<std::uint64_t>(buffer_), name_);
}

void Buffer::release() noexcept {
    if (device_ == nullptr) return;
    Device::State& state = device_->state();
    vkDestroyBuffer(state.device, buffer_, nullptr);
    state.device_memory->give_back(*memory_);
    memory_.reset();
    state.allocated -= allocated_;
    buffer_ = VK_NULL_HANDLE;
    mapped_ = direct_ = nullptr;
    bytes_ = allocated_ = 0;
    device_ = nullptr;
}

Buffer::~Buffer() {
    release();
}

Buffer::Buffer(Buffer&& other) noexcept {
    *this = std::move(other);
}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
    if (this == &other) return *this;
    release();
    device_ = std::exchange(other.device_, nullptr);
    name_ = std::move(other.name_);
    buffer_ = std::exchange(other.buffer_, VK_NULL_HANDLE);
    memory_ = std::move(other.memory_);
    mapped_ = std::exchange(other.mapped_, nullptr);
    direct_ = std::exchange(other.direct_, nullptr);
    bytes_ = std::exchange(other.bytes_, 0);
    allocated_ = std::exchange(other.allocated_, 0);
    return *this;
}

void Buffer::upload(std::span<const std::byte> source, std::uint64_t offset) {
    if (source.size() > bytes_ || offset > bytes_ - source.size())
        throw_outside(name_, offset, source.size(), bytes_);
    if (source.empty()) return;
    Device::State& state = device_->state();
    check_vulkan(state.wait_for_submitted(), "upload to " + describe(name_, source.size()));
    if (direct_ != nullptr) {
        std::memcpy(static_cast<std::byte*>(direct_) + offset, source.data(), source.size());
        return;
    }
    const Buffer staging = staging_for(*device_, source.size());
    for (std::uint64_t done = 0; done < source.size(); done += kStagingBytes) {
        const std::uint64_t piece = std::min(kStagingBytes, source.size() - done);
        std::memcpy(staging.direct_, source.data() + done, piece);
        state.copy_now(staging.buffer_, 0, buffer_, offset + done, piece, "upload to " + name_);
    }
}

void Buffer::upload_by(std::uint64_t size, const std::function<void(std::byte*)>& write) {
    if (size > bytes_) throw_outside(name_, 0, size, bytes_);
    if (direct_ != nullptr) {
        check_vulkan(device_->state().wait_for_submitted(), "upload to " + describe(name_, size));
        return write(static_cast<std::byte*>(direct_));
    }
    std::vector<std::byte> bytes(size);
    write(bytes.data());
    upload(bytes);
}

void Buffer::download(std::span<std::byte> target, std::uint64_t offset) const {
    if (target.size() > bytes_ || offset > bytes_ - target.size())
        throw_outside(name_, offset, target.size(), bytes_);
    if (target.empty()) return;
    Device::State& state = device_->state();
    check_vulkan(state.wait_for_submitted(), "download of " + describe(name_, target.size()));
    if (state.compile_only) {
        std::memset(target.data(), 0, target.size());
        return;
    }
    if (direct_ != nullptr) {
        std::memcpy(target.data(), static_cast<const std::byte*>(direct_) + offset, target.size());
        return;
    }
    const Buffer staging = staging_for(*device_, target.size());
    for (std::uint64_t done = 0; done < target.size(); done += kStagingBytes) {
        const std::uint64_t piece = std::min(kStagingBytes, target.size() - done);
        state.copy_now(buffer_, offset + done, staging.buffer_, 0, piece, "download of " + name_);
        std::memcpy(target.data() + done, staging.direct_, piece);
    }
}

void Device::State::copy_now(VkBuffer from, std::uint64_t from_offset, VkBuffer to,
                             std::uint64_t to_offset, std::uint64_t bytes,
                             const std::string& what) {
    const std::lock_guard lock(copy_mutex);
    if (copy_pool == VK_NULL_HANDLE) {
        VkCommandPoolCreateInfo pool_info{};
        pool_info.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
        pool_info.queueFamilyIndex = queue_family;
        check_vulkan(vkCreateCommandPool(device, &pool_info, nullptr, &copy_pool), what);
        VkCommandBufferAllocateInfo allocate{};
        allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
        allocate.commandPool = copy_pool;
        allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
        allocate.commandBufferCount = 1;
        check_vulkan(vkAllocateCommandBuffers(device, &allocate, &copy_commands), what);
    }
    check_vulkan(vkResetCommandPool(device, copy_pool, 0), what);
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check_vulkan(vkBeginCommandBuffer(copy_commands, &begin), what);
    // Having waited makes writes available, not visible.
    record_barrier(copy_commands, full_barrier());
    const VkBufferCopy region{from_offset, to_offset, bytes};
    vkCmdCopyBuffer(copy_commands, from, to, 1, &region);
    VkMemoryBarrier2 barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2;
    barrier.srcStageMask = VK_PIPELINE_STAGE_2_COPY_BIT;
    barrier.srcAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT;
    barrier.dstStageMask = VK_PIPELINE_STAGE_2_HOST_BIT;
    barrier.dstAccessMask = VK_ACCESS_2_HOST_READ_BIT;
    record_barrier(copy_commands, barrier);
    check_vulkan(vkEndCommandBuffer(copy_commands), what);
    check_vulkan(submit_copy(copy_commands), what);
    check_vulkan(wait_idle(), what);
}

}  // namespace darb
