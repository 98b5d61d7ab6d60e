// Memory of buffers and images: which type of the device's they get. Private to engine/gpu.
#pragma once

#include <vulkan/vulkan.h>

#include <string>

#include "engine/gpu/buffer.h"
#include "engine/gpu/device_state.h"

namespace darb {

inline constexpr VkMemoryPropertyFlags kMappable =
    VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
inline constexpr VkMemoryPropertyFlags kCached = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;

struct DeviceMemory {
    VkDeviceMemory handle = VK_NULL_HANDLE;  // the caller frees it
    VkMemoryPropertyFlags flags = 0;
};

/// what: for errors. Throws Error where there is not so much.
DeviceMemory allocate_memory(const Device::State& state, const VkMemoryRequirements& needs,
                             Memory kind, const std::string& what);

}  // namespace darb
