// SPDX-License-Identifier: MIT
// What the shaders of the table need of a device, read from the capabilities of their SPIR-V: so
// that a device is asked for no more, and one that is refused learns which shader it fails. Private
// to engine/gpu.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/gpu/shader_table.h"

namespace darb {

/// The chain that the query of a device and vkCreateDevice share.
struct DeviceFeatures {
    VkPhysicalDeviceFeatures2 core{};
    VkPhysicalDeviceVulkan11Features v11{};
    VkPhysicalDeviceVulkan12Features v12{};
    VkPhysicalDeviceVulkan13Features v13{};

    DeviceFeatures();
    DeviceFeatures(const DeviceFeatures&) = delete;
    DeviceFeatures& operator=(const DeviceFeatures&) = delete;
};

/// A capability of SPIR-V and the first shader that asks for it.
struct ShaderNeed {
    std::uint32_t capability = 0;
    std::string shader;
};

/// Each capability once, in order of its number. Aborts on one that this file does not know, as no
/// device could be held to it.
std::vector<ShaderNeed> shader_needs(std::span<const ShaderBinary> shaders);
/// The needs of all shaders in the embedded table, which is read once per process.
const std::vector<ShaderNeed>& needs_of_all_shaders();

/// Turns on what these needs and this project's own Vulkan calls take, nothing else: robust access,
/// for one, would cost time.
void want_features(const std::vector<ShaderNeed>& needs, DeviceFeatures& wanted);

/// What is missing first, and who needs it ("no shaderInt64, which shader x needs"); "" where a
/// device offers all.
std::string missing_feature(const std::vector<ShaderNeed>& needs, DeviceFeatures& offered,
                            VkSubgroupFeatureFlags subgroup_operations);

}  // namespace darb
