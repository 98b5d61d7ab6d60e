#include "engine/gpu/device_memory.h"

#include <fmt/format.h>

#include <initializer_list>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr VkMemoryPropertyFlags kDeviceLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;

// The first memory type that has the earliest of the wanted sets of flags.
int find_memory_type(const VkPhysicalDeviceMemoryProperties& memory, std::uint32_t allowed,
                     std::initializer_list<VkMemoryPropertyFlags> wanted) {
    for (const VkMemoryPropertyFlags flags : wanted)
        for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i)
            if ((allowed >> i & 1) && (memory.memoryTypes[i].propertyFlags & flags) == flags)
                return static_cast<int>(i);
    return -1;
}

int choose_memory_type(const Device::State& state, std::uint32_t allowed, Memory kind) {
    if (kind == Memory::host)
        return find_memory_type(state.memory, allowed, {kMappable | kCached, kMappable});
    if (state.info.unified_memory)
        return find_memory_type(state.memory, allowed,
                                {kDeviceLocal | kMappable | kCached, kDeviceLocal, 0});
    return find_memory_type(state.memory, allowed, {kDeviceLocal, 0});
}

}  // namespace

DeviceMemory allocate_memory(const Device::State& state, const VkMemoryRequirements& needs,
                             Memory kind, const std::string& what) {
    const int type = choose_memory_type(state, needs.memoryTypeBits, kind);
    if (type < 0)
        throw Error(what,
                    fmt::format("the driver has no memory for it, of {:#x}", needs.memoryTypeBits),
                    "Choose another device with --device, or install another driver.");
    VkMemoryAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    info.allocationSize = needs.size;
    info.memoryTypeIndex = static_cast<std::uint32_t>(type);
    DeviceMemory memory;
    check_vulkan(vkAllocateMemory(state.device, &info, nullptr, &memory.handle), what);
    memory.flags = state.memory.memoryTypes[type].propertyFlags;
    return memory;
}

}  // namespace darb
