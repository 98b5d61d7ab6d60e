// SPDX-License-Identifier: MIT
#include "engine/gpu/device.h"
#include "engine/gpu/shader_table.h"

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>
#include "engine/core/system.h"

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/core/user_folders.h"
#include "engine/gpu/device_state.h"
#include "engine/gpu/pipeline.h"
#include "engine/gpu/spirv_reflect.h"

namespace darb {

std::uint32_t lanes_by_pixels(const DeviceInfo& info, std::uint32_t chosen) {
    constexpr std::uint32_t most = 32, shared_bytes = 32 * 1024;
    if (info.shared_memory_bytes < shared_bytes || info.min_subgroup_size > most) return 0;
    return std::min(chosen, most);
}

Tuning usual_tuning(const DeviceInfo& info) {
    constexpr std::uint32_t blocks = 4;  // per tile; a subgroup per block is best on lavapipe
    const bool lavapipe = info.driver.starts_with("llvmpipe");
    Tuning tuning;
    tuning.scan_by_thread = lavapipe;
    tuning.scatter = lavapipe ? SortScatter::columns : SortScatter::ballot;
    tuning.blend_threads = blocks * std::clamp(info.subgroup_size, 4u, 64u);
    tuning.backward = lavapipe ? BackwardBlend::subgroup : BackwardBlend::team;
    return tuning;
}

namespace {

// Vulkan's header names it only with VK_ENABLE_BETA_EXTENSIONS.
constexpr const char* kPortabilitySubset = "VK_KHR_portability_subset";

constexpr const char* kStatistics = VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME;

// Position in the list.
std::size_t choose(const std::vector<ListedDevice>& all, const std::string& select) {
    std::vector<DeviceInfo> infos;
    for (const ListedDevice& device : all) infos.push_back(device.info);
    return choose_device(infos, select);
}

bool offers_extension(VkPhysicalDevice physical, const std::string& name) {
    std::uint32_t count = 0;
    vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> offered(count);
    vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, offered.data());
    return std::any_of(offered.begin(), offered.end(), [&](const VkExtensionProperties& e) {
        return name == std::string_view(e.extensionName);
    });
}

}  // namespace

Device::State::State(const DeviceOptions& options, bool validation)
    : instance(validation, options.instance_extensions) {
    faults = options.faults;
    compile_only = options.compile_only;
    if (options.keep_pipelines) pipelines.keep();
    const std::vector<ListedDevice> all = list_devices(instance);
    const std::size_t chosen = choose(all, options.select);
    physical = all[chosen].handle;
    info = all[chosen].info;
    for (std::size_t i = 0; i < all.size(); ++i)
        if (i != chosen && all[i].info.usable) others.push_back(all[i].info.name);
    if (faults.binding_bytes != 0) info.max_storage_buffer_bytes = faults.binding_bytes;
    if (faults.discrete) info.unified_memory = false;
    if (faults.allocation_bytes != 0) info.max_allocation_bytes = faults.allocation_bytes;
    if (faults.storage_buffers != 0)
        info.max_storage_buffers = static_cast<std::uint32_t>(
            std::min<std::uint64_t>(info.max_storage_buffers, faults.storage_buffers));
    if (faults.no_half) info.half_arithmetic = false;
    if (faults.own_subgroups) info.requires_subgroup_size = false;
    keep_subgroup_sizes(info);
    // Its blends need what BackwardBlend::pixels needs.
    if (lanes_by_pixels(info, info.subgroup_size) == 0) info.half_arithmetic = false;
    info.max_storage_buffer_bytes =
        std::min(info.max_storage_buffer_bytes, info.max_allocation_bytes);
    tuning = usual_tuning(info);
    lavapipe = info.driver.starts_with("llvmpipe");
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    try {
        create_device(options);
        create_cache(options);
    } catch (...) {
        release();
        throw;
    }
}

void Device::State::create_device(const DeviceOptions& options) {
    VkPhysicalDeviceProperties properties{};
    vkGetPhysicalDeviceProperties(physical, &properties);
    limits = properties.limits;

    queue_family = static_cast<std::uint32_t>(compute_queue_family(physical));
    std::uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
    timestamp_bits = faults.timestamp_bits.value_or(families[queue_family].timestampValidBits);
    if (timestamp_bits == 0) info.timestamp_period_ns = 0;
    queue_graphics = (families[queue_family].queueFlags & VK_QUEUE_GRAPHICS_BIT) != 0;

    DeviceFeatures wanted;
    want_features(needs_of_all_shaders(), wanted);
    wanted.v12.shaderFloat16 = info.half_arithmetic ? VK_TRUE : VK_FALSE;
    std::vector<const char*> extensions;
    for (const std::string& name : options.device_extensions) {
        if (!offers_extension(physical, name))
            throw Error(info.name, "does not offer " + name,
                        "Choose another device with --device (darb devices lists them); without a "
                        "window: darb view --screenshot, darb render, or darb train without "
                        "--view.");
        extensions.push_back(name.c_str());
    }
    // Must be enabled where it is offered. None of the features that it takes away is used here.
    if (offers_extension(physical, kPortabilitySubset)) extensions.push_back(kPortabilitySubset);
    const bool statistics = compile_only && offers_extension(physical, kStatistics);
    VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR executable_features{};
    if (statistics) {
        extensions.push_back(kStatistics);
        executable_features.sType =
            VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR;
        executable_features.pipelineExecutableInfo = VK_TRUE;
        executable_features.pNext = std::exchange(wanted.core.pNext, &executable_features);
    }

    const float priority = 1;
    VkDeviceQueueCreateInfo queue_info{};
    queue_info.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
    queue_info.queueFamilyIndex = queue_family;
    queue_info.queueCount = 1;
    queue_info.pQueuePriorities = &priority;
    VkDeviceCreateInfo device_info{};
    device_info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    device_info.pNext = &wanted.core;
    device_info.queueCreateInfoCount = 1;
    device_info.pQueueCreateInfos = &queue_info;
    device_info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
    device_info.ppEnabledExtensionNames = extensions.data();
    check_vulkan(vkCreateDevice(physical, &device_info, nullptr, &device), info.name);
    vkGetDeviceQueue(device, queue_family, 0, &queue);
    device_memory = std::make_unique<DeviceMemory>(*this);
    if (statistics) load_statistics();
}

void Device::State::load_statistics() {
    executable.properties = reinterpret_cast<PFN_vkGetPipelineExecutablePropertiesKHR>(
        vkGetDeviceProcAddr(device, "vkGetPipelineExecutablePropertiesKHR"));
    executable.statistics = reinterpret_cast<PFN_vkGetPipelineExecutableStatisticsKHR>(
        vkGetDeviceProcAddr(device, "vkGetPipelineExecutableStatisticsKHR"));
}

void Device::State::create_cache(const DeviceOptions& options) {
    cache_folder = options.cache_folder;
    VkPhysicalDeviceIDProperties id{};
    id.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES;
    VkPhysicalDeviceProperties2 properties{};
    properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
    properties.pNext = &id;
    vkGetPhysicalDeviceProperties2(physical, &properties);
    std::vector<std::byte> data;
    if (!cache_folder.empty() && !compile_only) {
        cache_file = cache_folder / fmt::format("pipelines-{}-{:08x}.bin", hex(id.deviceUUID),
                                                properties.properties.driverVersion);
        data = load_pipeline_cache(cache_file);
    }
    loaded_cache_bytes = data.size();
    VkPipelineCacheCreateInfo cache_info{};
    cache_info.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO;
    cache_info.initialDataSize = data.size();
    cache_info.pInitialData = data.data();
    check_vulkan(vkCreatePipelineCache(device, &cache_info, nullptr, &cache), "pipeline cache");
}

Device::State::~State() {
    if (device != VK_NULL_HANDLE) wait_idle();
    std::size_t bytes = 0;
    if (!cache_file.empty() &&
        vkGetPipelineCacheData(device, cache, &bytes, nullptr) == VK_SUCCESS &&
        bytes > sizeof(VkPipelineCacheHeaderVersionOne) && bytes != loaded_cache_bytes) {
        std::vector<std::byte> data(bytes);
        if (vkGetPipelineCacheData(device, cache, &bytes, data.data()) == VK_SUCCESS)
            save_pipeline_cache(cache_file, std::span(data).first(bytes));
    }
    release();
}

void Device::State::release() noexcept {
    if (device == VK_NULL_HANDLE) return;
    device_memory.reset();
    pipelines.clear();
    vkDestroyCommandPool(device, copy_pool, nullptr);
    vkDestroyPipelineCache(device, cache, nullptr);
    vkDestroyDevice(device, nullptr);
    device = VK_NULL_HANDLE;
}

void Device::State::set_name(VkObjectType type, std::uint64_t handle,
                             const std::string& name) const {
    if (instance.debug().set_name == nullptr) return;
    VkDebugUtilsObjectNameInfoEXT name_info{};
    name_info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT;
    name_info.objectType = type;
    name_info.objectHandle = handle;
    name_info.pObjectName = name.c_str();
    instance.debug().set_name(device, &name_info);
}

VkResult Device::State::submit(VkCommandBuffer commands, VkFence fence, VkSemaphore wait_for,
                               VkSemaphore signal) {
    if (faults.fails_submit(++submits)) return VK_ERROR_DEVICE_LOST;
    return give_to_queue(commands, fence, wait_for, signal);
}

VkResult Device::State::submit_copy(VkCommandBuffer commands) {
    if (faults.fails_submit(submits.load())) return VK_ERROR_DEVICE_LOST;
    return give_to_queue(commands, VK_NULL_HANDLE, VK_NULL_HANDLE, VK_NULL_HANDLE);
}

VkResult Device::State::give_to_queue(VkCommandBuffer commands, VkFence fence, VkSemaphore wait_for,
                                      VkSemaphore signal) {
    if (compile_only) return VK_SUCCESS;
    VkCommandBufferSubmitInfo buffer_info{};
    buffer_info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO;
    buffer_info.commandBuffer = commands;
    VkSubmitInfo2 submit_info{};
    submit_info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2;
    submit_info.commandBufferInfoCount = 1;
    submit_info.pCommandBufferInfos = &buffer_info;
    VkSemaphoreSubmitInfo semaphores[2]{};
    for (VkSemaphoreSubmitInfo& one : semaphores) {
        one.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO;
        one.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
    }
    semaphores[0].semaphore = wait_for;
    semaphores[1].semaphore = signal;
    submit_info.waitSemaphoreInfoCount = wait_for != VK_NULL_HANDLE ? 1 : 0;
    submit_info.pWaitSemaphoreInfos = &semaphores[0];
    submit_info.signalSemaphoreInfoCount = signal != VK_NULL_HANDLE ? 1 : 0;
    submit_info.pSignalSemaphoreInfos = &semaphores[1];
    const std::lock_guard lock(queue_mutex);
    submitted = true;
    return vkQueueSubmit2(queue, 1, &submit_info, fence);
}

VkResult Device::State::wait_idle() {
    if (compile_only) return VK_SUCCESS;
    const std::lock_guard lock(queue_mutex);
    const VkResult result = vkQueueWaitIdle(queue);
    if (result == VK_SUCCESS) submitted = false;
    return result;
}

VkResult Device::State::wait_for_submitted() {
    {
        const std::lock_guard lock(queue_mutex);
        if (!submitted) return VK_SUCCESS;
    }
    return wait_idle();
}

Device::Device(const DeviceOptions& options)
    : state_(std::make_unique<State>(options, options.validation)) {}

Device::~Device() {
    if (state_ && state_->allocated != 0)
        fmt::print(stderr, "darb: {} bytes of buffers outlive their device\n",
                   state_->allocated.load());
}

const DeviceInfo& Device::info() const {
    return state_->info;
}
std::string Device::description() const {
    return describe_choice(info(), state_->others);
}
bool Device::is_lavapipe() const {
    return state_->lavapipe;
}
VkInstance Device::instance() const {
    return state_->instance.handle();
}
VkPhysicalDevice Device::physical() const {
    return state_->physical;
}
VkDevice Device::handle() const {
    return state_->device;
}
VkQueue Device::queue() const {
    return state_->queue;
}
std::uint32_t Device::queue_family() const {
    return state_->queue_family;
}
bool Device::queue_has_graphics() const {
    return state_->queue_graphics;
}
VkPipelineCache Device::pipeline_cache() const {
    return state_->cache;
}
const std::filesystem::path& Device::cache_folder() const {
    return state_->cache_folder;
}
void Device::set_tuning(const Tuning& tuning) {
    state_->tuning = tuning;
}
const Tuning& Device::tuning() const {
    return state_->tuning;
}
std::uint64_t Device::allocated_bytes() const {
    return state_->allocated;
}
std::uint64_t Device::peak_bytes() const {
    return state_->peak;
}
void Device::forget_peak() {
    state_->peak = state_->allocated.load();
}
void Device::set_memory_budget(std::uint64_t bytes) {
    state_->budget = bytes;
}
std::uint64_t Device::memory_budget() const {
    return state_->budget;
}
const std::vector<CompiledPipeline>& Device::compiled() const {
    return state_->compiled;
}
bool Device::has_pipeline_statistics() const {
    return state_->executable.statistics != nullptr;
}
std::uint64_t Device::validation_message_count() const {
    return state_->instance.message_count();
}
void Device::wait_idle() const {
    check_vulkan(state_->wait_idle(), state_->info.name);
}
VkResult Device::present(const VkPresentInfoKHR& info) const {
    const std::lock_guard lock(state_->queue_mutex);
    return vkQueuePresentKHR(state_->queue, &info);
}

// What devices there are, which are usable, and which is meant by --device.

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

bool half_arithmetic(VkPhysicalDevice device) {
    DeviceFeatures offered;
    vkGetPhysicalDeviceFeatures2(device, &offered.core);
    return offered.v12.shaderFloat16 == VK_TRUE;
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
    VkPhysicalDeviceMaintenance4Properties buffers{};  // core since Vulkan 1.3
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
    info.half_arithmetic = half_arithmetic(device);
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

std::vector<DeviceInfo> list_devices() {
    check_vulkan_loader();
    try {
        const Instance instance(false, {});
        std::vector<DeviceInfo> infos;
        for (ListedDevice& device : list_devices(instance)) infos.push_back(std::move(device.info));
        return infos;
    } catch (const Error&) {
        return {};
    }
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

#ifdef _WIN32
constexpr const char* kGetDriver = "Install the newest driver of your graphics card.";
#else
constexpr const char* kGetDriver = "Install a driver: mesa-vulkan-drivers has one for every CPU.";
#endif

std::size_t choose_device(const std::vector<DeviceInfo>& devices, const std::string& select) {
    const std::string where = select.empty() ? "device" : "--device " + select;
    const std::string hint = "See darb devices.";
    if (devices.empty()) throw Error(where, "there is no Vulkan device", kGetDriver);
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

void check_vulkan(VkResult result, const std::string& what) {
    switch (result) {
        case VK_SUCCESS:
            return;
        case VK_ERROR_OUT_OF_HOST_MEMORY:
            throw NoRoom(what, "out of host memory",
                         "Close other programs or use a smaller scene.");
        case VK_ERROR_OUT_OF_DEVICE_MEMORY:
            throw NoRoom(what, "out of device memory",
                         "Close other programs, use smaller images or fewer splats, or choose "
                         "another device (darb devices).");
        case VK_ERROR_TOO_MANY_OBJECTS:
            throw NoRoom(what, "more buffers than the driver allows at once",
                         "Buffers of more than 8 MiB are an allocation each, and each photo of a "
                         "training run is a buffer: train at a lower resolution (-r), use fewer "
                         "photos, or choose another device (darb devices).");
        case VK_ERROR_DEVICE_LOST:
            throw DeviceLost(
                what, "the device was lost",
                "The driver stopped the device: a time-out, a driver fault or a device "
                "that was removed. See the system log; restart from the last checkpoint.");
        case VK_ERROR_SURFACE_LOST_KHR:
            throw Error(what, "the display is gone", "Start it again on one that is there.");
        case VK_ERROR_INCOMPATIBLE_DRIVER:
            throw Error(what, "no Vulkan driver was found",
                        "Install one: mesa-vulkan-drivers, or the driver of the GPU's vendor.");
        case VK_ERROR_LAYER_NOT_PRESENT:
            throw Error(what, "a Vulkan layer is missing", "Install vulkan-validationlayers.");
        case VK_ERROR_EXTENSION_NOT_PRESENT:
            throw Error(what, "a Vulkan extension is missing", "Update the driver.");
        case VK_ERROR_FEATURE_NOT_PRESENT:
            throw Error(what, "a Vulkan feature is missing", "Update the driver.");
        case VK_ERROR_INITIALIZATION_FAILED:
            throw Error(what, "the driver could not start", "Check with vulkaninfo.");
        default:
            throw Error(what, fmt::format("VkResult {}", static_cast<int>(result)),
                        "Run with DARB_VALIDATION=1 for details.");
    }
}

namespace {

// The key of Mesa's shader cache leaves out lavapipe's vector width: a cache filled at one width
// gives wrong sums at another (seen on Mesa 22.3), so each width gets its own folder.
void separate_mesa_caches(const std::filesystem::path& root) {
    if (root.empty() || std::getenv("MESA_SHADER_CACHE_DIR") != nullptr) return;
    const char* width = std::getenv("LP_NATIVE_VECTOR_WIDTH");
    const std::filesystem::path folder =
        root / ("mesa-width-" + std::string(width != nullptr ? width : "default"));
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!error) set_missing_environment("MESA_SHADER_CACHE_DIR", folder.string());
}

}  // namespace

DeviceOptions command_device(const std::string& select) {
    DeviceOptions options;
    options.select = select;
    options.cache_folder = cache_folder();
    separate_mesa_caches(options.cache_folder);
    const char* validation = std::getenv("DARB_VALIDATION");
    options.validation =
        validation != nullptr && *validation != '\0' && std::string_view(validation) != "0";
    if (const char* faults = std::getenv("DARB_FAULT")) options.faults = parse_faults(faults);
    return options;
}

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
constexpr std::uint32_t kHalfArithmetic = 9;  // shaders with it are not made where it is missing
const Capability kCapabilities[] = {
    {1, "compute shaders"},
    {kHalfArithmetic, "shaderFloat16", DARB_FEATURE(v12.shaderFloat16)},
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
                       "engine/gpu/device.cpp has no row",
                       shader.name, number);
            first.emplace(number, shader.name);
        }
    std::vector<ShaderNeed> needs;
    for (const auto& [number, shader] : first) needs.push_back({number, shader});
    return needs;
}

const std::vector<ShaderNeed>& needs_of_all_shaders() {
    static const std::vector<ShaderNeed> needs = [] {
        std::vector<ShaderNeed> all = shader_needs(shader_table());
        std::erase_if(all, [](const ShaderNeed& n) { return n.capability == kHalfArithmetic; });
        return all;
    }();
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
