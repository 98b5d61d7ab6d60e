// SPDX-License-Identifier: MIT
#include "engine/gpu/shader_features.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "engine/core/error.h"
#include "engine/gpu/spirv_reflect.h"

namespace darb {

namespace {

using Feature = VkBool32& (*)(DeviceFeatures&);

// A capability is covered by a feature, by a kind of subgroup operations, or by Vulkan 1.3 itself.
struct Capability {
    std::uint32_t number;  // in the SPIR-V specification, section 3.31
    const char* name;      // name of the feature or operations
    Feature feature = nullptr;
    VkSubgroupFeatureFlags operations = 0;
};

#define DARB_FEATURE(path) [](DeviceFeatures& f) -> VkBool32& { return f.path; }
const Capability kCapabilities[] = {
    {1, "compute shaders"},
    {9, "shaderFloat16", DARB_FEATURE(v12.shaderFloat16)},
    {10, "shaderFloat64", DARB_FEATURE(core.features.shaderFloat64)},
    {11, "shaderInt64", DARB_FEATURE(core.features.shaderInt64)},
    {12, "shaderBufferInt64Atomics", DARB_FEATURE(v12.shaderBufferInt64Atomics)},
    {22, "shaderInt16", DARB_FEATURE(core.features.shaderInt16)},
    {39, "shaderInt8", DARB_FEATURE(v12.shaderInt8)},
    {61, "subgroup operations", nullptr, VK_SUBGROUP_FEATURE_BASIC_BIT},
    {62, "subgroup votes", nullptr, VK_SUBGROUP_FEATURE_VOTE_BIT},
    {63, "subgroup arithmetic", nullptr, VK_SUBGROUP_FEATURE_ARITHMETIC_BIT},
    {64, "subgroup ballots", nullptr, VK_SUBGROUP_FEATURE_BALLOT_BIT},
    {65, "subgroup shuffles", nullptr, VK_SUBGROUP_FEATURE_SHUFFLE_BIT},
    {66, "relative subgroup shuffles", nullptr, VK_SUBGROUP_FEATURE_SHUFFLE_RELATIVE_BIT},
    {67, "clustered subgroup operations", nullptr, VK_SUBGROUP_FEATURE_CLUSTERED_BIT},
    {68, "subgroup operations on quads", nullptr, VK_SUBGROUP_FEATURE_QUAD_BIT},
    {4433, "storageBuffer16BitAccess", DARB_FEATURE(v11.storageBuffer16BitAccess)},
    {4448, "storageBuffer8BitAccess", DARB_FEATURE(v12.storageBuffer8BitAccess)},
    {5345, "vulkanMemoryModel", DARB_FEATURE(v12.vulkanMemoryModel)},
    {5346, "vulkanMemoryModelDeviceScope", DARB_FEATURE(v12.vulkanMemoryModelDeviceScope)},
    {5347, "bufferDeviceAddress", DARB_FEATURE(v12.bufferDeviceAddress)},
};

// What no capability says.
struct OwnFeature {
    const char* name;
    const char* who;
    Feature feature;
};
const OwnFeature kOwnFeatures[] = {
    {"scalarBlockLayout", "the arguments and buffers of all shaders need",
     DARB_FEATURE(v12.scalarBlockLayout)},
    {"synchronization2", "all barriers need", DARB_FEATURE(v13.synchronization2)},
    {"subgroupSizeControl", "shaders with subgroup operations need",
     DARB_FEATURE(v13.subgroupSizeControl)},
    {"computeFullSubgroups", "shaders with subgroup operations need",
     DARB_FEATURE(v13.computeFullSubgroups)},
};
#undef DARB_FEATURE

const Capability* find_capability(std::uint32_t number) {
    const auto found = std::find_if(std::begin(kCapabilities), std::end(kCapabilities),
                                    [&](const Capability& c) { return c.number == number; });
    return found == std::end(kCapabilities) ? nullptr : found;
}

}  // namespace

DeviceFeatures::DeviceFeatures() {
    core.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    v11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES;
    v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    v13.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES;
    core.pNext = &v11;
    v11.pNext = &v12;
    v12.pNext = &v13;
}

std::vector<ShaderNeed> shader_needs(std::span<const ShaderBinary> shaders) {
    std::map<std::uint32_t, std::string> first;
    for (const ShaderBinary& shader : shaders)
        for (const std::uint32_t number : reflect_spirv(shader.words, shader.name).capabilities) {
            DARB_CHECK(find_capability(number) != nullptr,
                       "shader {} asks for the capability {} of SPIR-V, for which "
                       "engine/gpu/shader_features.cpp has no row",
                       shader.name, number);
            first.emplace(number, shader.name);
        }
    std::vector<ShaderNeed> needs;
    for (const auto& [number, shader] : first) needs.push_back({number, shader});
    return needs;
}

const std::vector<ShaderNeed>& needs_of_all_shaders() {
    static const std::vector<ShaderNeed> needs = shader_needs(shader_table());
    return needs;
}

void want_features(const std::vector<ShaderNeed>& needs, DeviceFeatures& wanted) {
    for (const OwnFeature& own : kOwnFeatures) own.feature(wanted) = VK_TRUE;
    for (const ShaderNeed& need : needs)
        if (const Capability& c = *find_capability(need.capability); c.feature != nullptr)
            c.feature(wanted) = VK_TRUE;
}

std::string missing_feature(const std::vector<ShaderNeed>& needs, DeviceFeatures& offered,
                            VkSubgroupFeatureFlags subgroup_operations) {
    for (const OwnFeature& own : kOwnFeatures)
        if (!own.feature(offered)) return fmt::format("no {}, which {}", own.name, own.who);
    for (const ShaderNeed& need : needs) {
        const Capability& c = *find_capability(need.capability);
        const bool offers = (c.feature == nullptr || c.feature(offered)) &&
                            (c.operations & ~subgroup_operations) == 0;
        if (!offers) return fmt::format("no {}, which shader {} needs", c.name, need.shader);
    }
    return {};
}

}  // namespace darb
