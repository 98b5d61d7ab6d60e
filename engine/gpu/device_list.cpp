// What devices there are, which are usable, and which is meant by --device.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <numeric>
#include <optional>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/gpu/device_state.h"
#include "engine/gpu/shader_features.h"
#include "engine/gpu/shader_table.h"
#include "engine/gpu/spirv_reflect.h"

namespace darb {

namespace {

constexpr std::uint32_t kMinSharedBytes = 16 * 1024;
constexpr std::uint32_t kMinSubgroup = 4, kMaxSubgroup = 64;  // lanes, of the blend passes

std::string type_name(VkPhysicalDeviceType type) {
    switch (type) {
        case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
            return "discrete";
        case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
            return "integrated";
        case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
            return "virtual";
        case VK_PHYSICAL_DEVICE_TYPE_CPU:
            return "cpu";
        default:
            return "other";
    }
}

int type_rank(const std::string& type) {
    constexpr const char* kOrder[] = {"discrete", "integrated", "virtual", "cpu"};
    const auto found = std::find(std::begin(kOrder), std::end(kOrder), type);
    return static_cast<int>(found - std::begin(kOrder));
}

bool has_extension(VkPhysicalDevice device, const char* name) {
    std::uint32_t count = 0;
    vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> all(count);
    vkEnumerateDeviceExtensionProperties(device, nullptr, &count, all.data());
    return std::any_of(all.begin(), all.end(), [&](const VkExtensionProperties& e) {
        return std::string_view(e.extensionName) == name;
    });
}

// The reason why a device cannot run the shaders, or "" if it can.
std::string missing_part(VkPhysicalDevice device, const DeviceInfo& info) {
    if (info.api_version < VK_API_VERSION_1_3)
        return fmt::format("Vulkan {}.{}, needs 1.3", VK_API_VERSION_MAJOR(info.api_version),
                           VK_API_VERSION_MINOR(info.api_version));
    if (compute_queue_family(device) < 0) return "no compute queue";

    DeviceFeatures offered;
    vkGetPhysicalDeviceFeatures2(device, &offered.core);
    VkPhysicalDeviceSubgroupProperties subgroup{};
    subgroup.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES;
    VkPhysicalDeviceProperties2 properties{};
    properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
    properties.pNext = &subgroup;
    vkGetPhysicalDeviceProperties2(device, &properties);
    const VkSubgroupFeatureFlags operations =
        (subgroup.supportedStages & VK_SHADER_STAGE_COMPUTE_BIT) != 0 ? subgroup.supportedOperations
                                                                      : 0;
    if (const std::string missing = missing_feature(needs_of_all_shaders(), offered, operations);
        !missing.empty())
        return missing;
    if (const std::string trouble = subgroup_trouble(info); !trouble.empty()) return trouble;
    if (info.shared_memory_bytes < kMinSharedBytes) return "less than 16 KiB of shared memory";
    return buffers_trouble(info, kRendering);
}

bool float_atomics(VkPhysicalDevice device) {
    if (!has_extension(device, VK_EXT_SHADER_ATOMIC_FLOAT_EXTENSION_NAME)) return false;
    VkPhysicalDeviceShaderAtomicFloatFeaturesEXT atomics{};
    atomics.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SHADER_ATOMIC_FLOAT_FEATURES_EXT;
    VkPhysicalDeviceFeatures2 features{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &atomics, {}};
    vkGetPhysicalDeviceFeatures2(device, &features);
    return atomics.shaderBufferFloat32AtomicAdd == VK_TRUE;
}

void describe_memory(VkPhysicalDevice device, DeviceInfo& info) {
    VkPhysicalDeviceMemoryProperties memory{};
    vkGetPhysicalDeviceMemoryProperties(device, &memory);
    for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i)
        if (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT)
            info.heap_bytes = std::max(info.heap_bytes, memory.memoryHeaps[i].size);
    const bool shares = info.type == "cpu" || info.type == "integrated";
    constexpr VkMemoryPropertyFlags kBoth =
        VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT | VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT;
    info.unified_memory =
        shares &&
        std::any_of(memory.memoryTypes, memory.memoryTypes + memory.memoryTypeCount,
                    [](const VkMemoryType& type) { return (type.propertyFlags & kBoth) == kBoth; });
}

DeviceInfo describe(VkPhysicalDevice device) {
    VkPhysicalDeviceSubgroupSizeControlProperties sizes{};
    sizes.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_PROPERTIES;
    VkPhysicalDeviceSubgroupProperties subgroup{};
    subgroup.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES;
    subgroup.pNext = &sizes;
    VkPhysicalDeviceDriverProperties driver{};
    driver.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES;
    driver.pNext = &subgroup;
    VkPhysicalDeviceMaintenance4Properties buffers{};  // of Vulkan 1.3
    buffers.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES;
    buffers.pNext = &driver;
    buffers.maxBufferSize = ~VkDeviceSize{0};
    VkPhysicalDeviceMaintenance3Properties maintenance{};
    maintenance.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES;
    maintenance.pNext = &buffers;
    VkPhysicalDeviceProperties2 properties{};
    properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
    properties.pNext = &maintenance;
    vkGetPhysicalDeviceProperties2(device, &properties);
    const VkPhysicalDeviceProperties& core = properties.properties;
    const VkPhysicalDeviceLimits& limits = core.limits;

    DeviceInfo info;
    info.name = core.deviceName;
    info.driver = fmt::format("{} {}", driver.driverName, driver.driverInfo);
    info.driver_version = core.driverVersion;
    info.cache_uuid = hex(core.pipelineCacheUUID);
    info.type = type_name(core.deviceType);
    info.conformant = driver.conformanceVersion.major != 0;
    info.api_version = core.apiVersion;
    info.max_storage_buffer_bytes = limits.maxStorageBufferRange;
    info.max_allocation_bytes =
        std::min(maintenance.maxMemoryAllocationSize, buffers.maxBufferSize);
    info.max_storage_buffers = limits.maxPerStageDescriptorStorageBuffers;
    info.max_workgroup_threads = limits.maxComputeWorkGroupInvocations;
    info.shared_memory_bytes = limits.maxComputeSharedMemorySize;
    info.max_groups_x = limits.maxComputeWorkGroupCount[0];
    info.subgroup_size = subgroup.subgroupSize;
    info.min_subgroup_size = sizes.minSubgroupSize;
    info.max_subgroup_size = sizes.maxSubgroupSize;
    info.requires_subgroup_size =
        (sizes.requiredSubgroupSizeStages & VK_SHADER_STAGE_COMPUTE_BIT) != 0;
    keep_subgroup_sizes(info);
    describe_memory(device, info);
    info.float_atomics = float_atomics(device);
    const int family = compute_queue_family(device);
    if (family >= 0) {
        std::uint32_t count = 0;
        vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
        std::vector<VkQueueFamilyProperties> families(count);
        vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
        if (families[static_cast<size_t>(family)].timestampValidBits > 0)
            info.timestamp_period_ns = static_cast<double>(limits.timestampPeriod);
    }
    const std::string missing = missing_part(device, info);
    info.usable = missing.empty();
    info.reason = info.usable ? info.type + " device" : "rejected: " + missing;
    if (info.usable && !info.conformant) info.reason += ", whose driver is not conformant";
    if (const std::string few = buffers_trouble(info, kTraining); info.usable && !few.empty())
        info.reason += ", which cannot train: " + few;
    return info;
}

std::optional<std::size_t> parse_index(const std::string& text) {
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

}  // namespace

std::string hex(std::span<const std::uint8_t> bytes) {
    std::string text;
    for (const std::uint8_t byte : bytes) text += fmt::format("{:02x}", byte);
    return text;
}

void keep_subgroup_sizes(DeviceInfo& info) {
    if (info.requires_subgroup_size) return;
    info.min_subgroup_size = info.max_subgroup_size = info.subgroup_size;
}

std::string subgroup_trouble(const DeviceInfo& info) {
    if (info.max_subgroup_size < kMinSubgroup || info.min_subgroup_size > kMaxSubgroup)
        return fmt::format("subgroups of {} to {} lanes, needs {} to {}", info.min_subgroup_size,
                           info.max_subgroup_size, kMinSubgroup, kMaxSubgroup);
    return {};
}

std::uint32_t storage_buffers(std::string_view shader) {
    const auto table = shader_table();
    const auto found = std::find_if(table.begin(), table.end(),
                                    [&](const ShaderBinary& s) { return s.name == shader; });
    DARB_CHECK(found != table.end(), "no shader {}", shader);
    return static_cast<std::uint32_t>(reflect_spirv(found->words, shader).bindings.size());
}

std::string buffers_trouble(const DeviceInfo& info, std::string_view shader) {
    const std::uint32_t needs = storage_buffers(shader);
    if (info.max_storage_buffers >= needs) return {};
    return fmt::format("{} storage buffers a shader, needs {}", info.max_storage_buffers, needs);
}

int compute_queue_family(VkPhysicalDevice device) {
    std::uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
    for (const VkQueueFlags wanted : {VkQueueFlags{VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT},
                                      VkQueueFlags{VK_QUEUE_COMPUTE_BIT}})
        for (std::uint32_t i = 0; i < count; ++i)
            if ((families[i].queueFlags & wanted) == wanted) return static_cast<int>(i);
    return -1;
}

std::vector<ListedDevice> list_devices(const Instance& instance) {
    std::vector<ListedDevice> all;
    for (VkPhysicalDevice handle : instance.physical_devices())
        all.push_back({handle, describe(handle)});
    std::stable_sort(all.begin(), all.end(), [](const ListedDevice& a, const ListedDevice& b) {
        if (a.info.usable != b.info.usable) return a.info.usable;
        if (a.info.type != b.info.type) return type_rank(a.info.type) < type_rank(b.info.type);
        return a.info.heap_bytes > b.info.heap_bytes;
    });
    for (size_t i = 0; i < all.size(); ++i) all[i].info.index = static_cast<int>(i);
    return all;
}

std::vector<DeviceInfo> list_devices() try {
    const Instance instance(false, {});
    std::vector<DeviceInfo> infos;
    for (ListedDevice& device : list_devices(instance)) infos.push_back(std::move(device.info));
    return infos;
} catch (const Error&) {
    return {};
}

std::string describe_choice(const DeviceInfo& chosen, const std::vector<std::string>& others) {
    std::string text = fmt::format("{} ({})", chosen.name, chosen.driver);
    if (!others.empty()) text += fmt::format("; --device also takes {}", fmt::join(others, ", "));
    if (!chosen.conformant)
        text +=
            "; the driver does not claim to be conformant: darb check tells whether it computes "
            "as it should";
    return text;
}

std::size_t choose_device(const std::vector<DeviceInfo>& devices, const std::string& select) {
    const std::string where = select.empty() ? "device" : "--device " + select;
    const std::string hint = "See darb devices.";
    if (devices.empty())
        throw Error(where, "there is no Vulkan device",
                    "Install a driver: mesa-vulkan-drivers has one for every CPU.");
    std::vector<std::size_t> candidates;
    if (const auto index = parse_index(select)) {
        if (*index >= devices.size())
            throw Error(where, fmt::format("devices: {}, counted from 0", devices.size()), hint);
        candidates = {*index};
    } else {
        for (std::size_t i = 0; i < devices.size(); ++i)
            if (lower(devices[i].name).find(lower(select)) != std::string::npos)
                candidates.push_back(i);
    }
    std::string names;
    for (const DeviceInfo& device : devices)
        names += fmt::format("{}{} ({})", names.empty() ? "" : ", ", device.name, device.reason);
    if (candidates.empty()) throw Error(where, "no device has such a name: " + names, hint);
    for (const std::size_t i : candidates)
        if (devices[i].usable) return i;
    throw Error(where, "no usable device: " + names, hint);
}

}  // namespace darb
