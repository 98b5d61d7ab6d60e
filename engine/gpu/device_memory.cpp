// SPDX-License-Identifier: MIT
#include "engine/gpu/device_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <iterator>
#include <utility>

#include "engine/core/error.h"
#include "engine/gpu/device_state.h"

namespace darb {

namespace {

constexpr VkMemoryPropertyFlags kDeviceLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;

// Buffers up to a size share blocks: a photo of 2 million pixels does, as do all that are many.
constexpr VkDeviceSize kBlockBytes = 64 << 20, kLargestShared = 8 << 20;
constexpr VkDeviceSize kBlocksOfHeap = 16;  // a block is at most this part of a heap

// The first memory type that has the earliest of the wanted sets of flags.
int find_memory_type(const VkPhysicalDeviceMemoryProperties& memory, std::uint32_t allowed,
                     std::initializer_list<VkMemoryPropertyFlags> wanted) {
    for (const VkMemoryPropertyFlags flags : wanted)
        for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i)
            if ((allowed >> i & 1) && (memory.memoryTypes[i].propertyFlags & flags) == flags)
                return static_cast<int>(i);
    return -1;
}

// The part of a block, if it has one that is free.
bool cut(MemoryBlock& block, const VkMemoryRequirements& needs, MemoryPiece& piece) {
    for (auto hole = block.free.begin(); hole != block.free.end(); ++hole) {
        const auto [begin, bytes] = *hole;
        const VkDeviceSize start =
            (begin + needs.alignment - 1) / needs.alignment * needs.alignment;
        if (start - begin > bytes || bytes - (start - begin) < needs.size) continue;
        const VkDeviceSize rest = bytes - (start - begin) - needs.size;
        if (start == begin)
            block.free.erase(hole);
        else
            hole->second = start - begin;
        if (rest > 0) block.free[start + needs.size] = rest;
        piece = block.whole;
        piece.offset = start;
        piece.bytes = needs.size;
        if (piece.mapped != nullptr) piece.mapped = static_cast<std::byte*>(piece.mapped) + start;
        piece.block = &block;
        return true;
    }
    return false;
}

void join(MemoryBlock& block, VkDeviceSize offset, VkDeviceSize bytes) {
    auto hole = block.free.emplace(offset, bytes).first;
    if (const auto next = std::next(hole);
        next != block.free.end() && offset + bytes == next->first) {
        hole->second += next->second;
        block.free.erase(next);
    }
    if (hole == block.free.begin()) return;
    if (const auto before = std::prev(hole); before->first + before->second == offset) {
        before->second += hole->second;
        block.free.erase(hole);
    }
}

}  // namespace

int DeviceMemory::choose_type(std::uint32_t allowed, Memory kind, const std::string& what) const {
    const VkPhysicalDeviceMemoryProperties& memory = state_.memory;
    int type = -1;
    if (kind != Memory::device)
        type = find_memory_type(memory, allowed, {kMappable | kCached, kMappable});
    else if (state_.info.unified_memory)
        type = find_memory_type(memory, allowed,
                                {kDeviceLocal | kMappable | kCached, kDeviceLocal, 0});
    else
        type = find_memory_type(memory, allowed, {kDeviceLocal, 0});
    if (type < 0)
        throw Error(what, fmt::format("the driver has no memory for it, of {:#x}", allowed),
                    "Choose another device with --device, or install another driver.");
    return type;
}

VkResult DeviceMemory::allocate(VkDeviceSize bytes, int type, MemoryPiece& piece) {
    if (state_.faults.fails_allocations(allocations_ + 1)) return VK_ERROR_TOO_MANY_OBJECTS;
    VkMemoryAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    info.allocationSize = bytes;
    info.memoryTypeIndex = static_cast<std::uint32_t>(type);
    piece = {};
    VkResult result = vkAllocateMemory(state_.device, &info, nullptr, &piece.handle);
    if (result != VK_SUCCESS) return result;
    ++allocations_;
    piece.bytes = bytes;
    piece.flags = state_.memory.memoryTypes[type].propertyFlags;
    if ((piece.flags & kMappable) == kMappable)
        result = vkMapMemory(state_.device, piece.handle, 0, VK_WHOLE_SIZE, 0, &piece.mapped);
    if (result != VK_SUCCESS) free(std::exchange(piece.handle, VK_NULL_HANDLE));
    return result;
}

void DeviceMemory::free(VkDeviceMemory handle) noexcept {
    if (handle == VK_NULL_HANDLE) return;
    vkFreeMemory(state_.device, handle, nullptr);
    --allocations_;
}

void DeviceMemory::free_empty_blocks() noexcept {
    for (auto block = blocks_.begin(); block != blocks_.end();) {
        const auto here = block++;
        if (!here->empty()) continue;
        free(here->whole.handle);
        blocks_.erase(here);
    }
}

MemoryPiece DeviceMemory::take_own_locked(const VkMemoryRequirements& needs, int type,
                                          const std::string& what) {
    MemoryPiece piece;
    VkResult result = allocate(needs.size, type, piece);
    if (result != VK_SUCCESS) {  // perhaps what blocks hold for others suffices
        free_empty_blocks();
        result = allocate(needs.size, type, piece);
    }
    check_vulkan(result, what);
    return piece;
}

MemoryBlock* DeviceMemory::add_block(int type) {
    const std::uint32_t heap = state_.memory.memoryTypes[type].heapIndex;
    const VkDeviceSize bytes =
        std::min({kBlockBytes, state_.memory.memoryHeaps[heap].size / kBlocksOfHeap,
                  static_cast<VkDeviceSize>(state_.info.max_allocation_bytes)});
    if (bytes < kLargestShared) return nullptr;
    MemoryPiece whole;
    if (allocate(bytes, type, whole) != VK_SUCCESS) return nullptr;
    MemoryBlock& block = blocks_.emplace_back();
    block.whole = whole;
    block.type = type;
    block.free[0] = bytes;
    return &block;
}

bool DeviceMemory::take_shared(const VkMemoryRequirements& needs, int type, MemoryPiece& piece) {
    for (MemoryBlock& block : blocks_)
        if (block.type == type && cut(block, needs, piece)) return true;
    MemoryBlock* block = add_block(type);
    return block != nullptr && cut(*block, needs, piece);
}

MemoryPiece DeviceMemory::take(const VkMemoryRequirements& needs, Memory kind,
                               const std::string& what) {
    const int type = choose_type(needs.memoryTypeBits, kind, what);
    const std::lock_guard lock(mutex_);
    MemoryPiece piece;
    if (needs.size <= kLargestShared && take_shared(needs, type, piece)) return piece;
    return take_own_locked(needs, type, what);
}

MemoryPiece DeviceMemory::take_own(const VkMemoryRequirements& needs, Memory kind,
                                   const std::string& what) {
    const int type = choose_type(needs.memoryTypeBits, kind, what);
    const std::lock_guard lock(mutex_);
    return take_own_locked(needs, type, what);
}

// One empty block is kept of a type: small buffers that come and go would else allocate each time.
void DeviceMemory::give_back(MemoryPiece& piece) noexcept {
    if (piece.handle == VK_NULL_HANDLE) return;
    const std::lock_guard lock(mutex_);
    if (piece.block == nullptr) {
        free(piece.handle);
    } else {
        MemoryBlock& block = *piece.block;
        join(block, piece.offset, piece.bytes);
        const bool another = std::any_of(blocks_.begin(), blocks_.end(), [&](const MemoryBlock& b) {
            return &b != &block && b.type == block.type && b.empty();
        });
        if (block.empty() && another) {
            free(block.whole.handle);
            blocks_.remove_if([&](const MemoryBlock& b) { return &b == &block; });
        }
    }
    piece = {};
}

DeviceMemory::~DeviceMemory() {
    for (const MemoryBlock& block : blocks_) free(block.whole.handle);
}

}  // namespace darb
