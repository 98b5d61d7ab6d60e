#include "engine/gpu/device.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/gpu/device_memory.h"
#include "engine/gpu/device_state.h"
#include "engine/gpu/shader_features.h"

namespace darb {

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

}  // namespace darb
