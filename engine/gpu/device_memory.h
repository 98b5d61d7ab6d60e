// SPDX-License-Identifier: MIT
// Memory of buffers and images: which type of the device's they get, and the blocks that small ones
// share, as some drivers allow 4,096 allocations at once. Private to engine/gpu.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <string>

#include "engine/gpu/buffer.h"

namespace darb {

inline constexpr VkMemoryPropertyFlags kMappable =
    VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
inline constexpr VkMemoryPropertyFlags kCached = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;

struct MemoryBlock;

/// An allocation of its own, or a part of a block.
struct MemoryPiece {
    VkDeviceMemory handle = VK_NULL_HANDLE;
    VkDeviceSize offset = 0, bytes = 0;
    VkMemoryPropertyFlags flags = 0;
    void* mapped = nullptr;        // its first byte, where the host may map it
    MemoryBlock* block = nullptr;  // null: an allocation of its own
};

struct MemoryBlock {
    MemoryPiece whole;
    int type = 0;
    std::map<VkDeviceSize, VkDeviceSize> free;  // offset -> bytes, never two side by side
    bool empty() const { return free.size() == 1 && free.begin()->second == whole.bytes; }
};

class DeviceMemory {
  public:
    explicit DeviceMemory(const Device::State& state) : state_(state) {}
    ~DeviceMemory();  // all pieces are back
    DeviceMemory(const DeviceMemory&) = delete;
    DeviceMemory& operator=(const DeviceMemory&) = delete;

    /// Memory for a buffer; from any thread. what: its name in errors. Throws NoRoom where there is
    /// not enough.
    MemoryPiece take(const VkMemoryRequirements& needs, Memory kind, const std::string& what);
    /// The same for an image, never from a block: beside buffers, images need other alignments.
    MemoryPiece take_own(const VkMemoryRequirements& needs, Memory kind, const std::string& what);
    void give_back(MemoryPiece& piece) noexcept;

    /// How many allocations of the driver's are alive: blocks, and pieces with their own memory.
    std::uint32_t allocations() const { return allocations_; }

  private:
    int choose_type(std::uint32_t allowed, Memory kind, const std::string& what) const;
    VkResult allocate(VkDeviceSize bytes, int type, MemoryPiece& piece);
    void free(VkDeviceMemory handle) noexcept;
    MemoryPiece take_own_locked(const VkMemoryRequirements& needs, int type,
                                const std::string& what);
    bool take_shared(const VkMemoryRequirements& needs, int type, MemoryPiece& piece);
    MemoryBlock* add_block(int type);
    void free_empty_blocks() noexcept;

    const Device::State& state_;
    std::mutex mutex_;
    std::list<MemoryBlock> blocks_;
    std::uint32_t allocations_ = 0;
};

}  // namespace darb
