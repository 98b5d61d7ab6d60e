// SPDX-License-Identifier: MIT
#include "engine/gpu/device_state.h"

#include <algorithm>
#include <cstdio>
#include <cstring>

#include "engine/core/error.h"
#include "engine/core/system.h"
#include "engine/gpu/device.h"

namespace darb {

namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

std::vector<VkExtensionProperties> offered_extensions(const char* layer) {
    std::uint32_t count = 0;
    vkEnumerateInstanceExtensionProperties(layer, &count, nullptr);
    std::vector<VkExtensionProperties> all(count);
    vkEnumerateInstanceExtensionProperties(layer, &count, all.data());
    all.resize(count);
    return all;
}

bool contains(const std::vector<VkExtensionProperties>& all, const std::string& name) {
    return std::any_of(all.begin(), all.end(),
                       [&](const VkExtensionProperties& e) { return name == e.extensionName; });
}

bool validation_installed() {
    std::uint32_t count = 0;
    vkEnumerateInstanceLayerProperties(&count, nullptr);
    std::vector<VkLayerProperties> all(count);
    vkEnumerateInstanceLayerProperties(&count, all.data());
    return std::any_of(all.begin(), all.end(), [](const VkLayerProperties& layer) {
        return std::strcmp(layer.layerName, kValidationLayer) == 0;
    });
}

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                          VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data,
                                          void* user) {
    static_cast<std::atomic<std::uint64_t>*>(user)->fetch_add(1);
    std::fprintf(stderr, "vulkan validation: %s\n", data->pMessage);
    return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messenger_info(std::atomic<std::uint64_t>* counter) {
    VkDebugUtilsMessengerCreateInfoEXT info{};
    info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
    info.messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                           VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    // Not GENERAL: the loader reports broken drivers of other vendors there.
    info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    info.pfnUserCallback = on_message;
    info.pUserData = counter;
    return info;
}

// The last instance that goes takes its drivers along, and NVIDIA's of 2026 does not come back
// after a few dozen times: one instance stays until the process ends.
void keep_drivers_loaded(const VkApplicationInfo& application, bool portable) {
    static const VkInstance kept = [&] {
        const char* portability = VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME;
        VkInstanceCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
        info.pApplicationInfo = &application;
        if (portable) {
            info.flags = VK_INSTANCE_CREATE_ENUMERATE_PORTABILITY_BIT_KHR;
            info.enabledExtensionCount = 1;
            info.ppEnabledExtensionNames = &portability;
        }
        VkInstance instance = VK_NULL_HANDLE;
        return vkCreateInstance(&info, nullptr, &instance) == VK_SUCCESS ? instance : VkInstance{};
    }();
    static_cast<void>(kept);
}

}  // namespace

void check_vulkan_loader() {
#ifdef _WIN32
    if (!can_load_library("vulkan-1.dll"))
        throw Error("Vulkan", "vulkan-1.dll is missing, so this computer has no Vulkan driver",
                    "Install the newest driver of your graphics card, from AMD, Intel or NVIDIA; "
                    "it brings Vulkan along.");
#endif
}

Instance::Instance(bool validation, const std::vector<std::string>& extensions)
    : messages_(std::make_unique<std::atomic<std::uint64_t>>(0)) {
    check_vulkan_loader();
    if (validation && !validation_installed())
        throw Error("Vulkan validation", std::string(kValidationLayer) + " is not installed",
                    "Install vulkan-validationlayers, or run without validation.");

    const std::vector<VkExtensionProperties> offered = offered_extensions(nullptr);
    std::vector<const char*> names;
    for (const std::string& name : extensions) {
        if (!contains(offered, name))
            throw Error("Vulkan instance", "no extension " + name,
                        "Run without a window, or install a driver with window support.");
        names.push_back(name.c_str());
    }
    const bool portable = contains(offered, VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME);
    if (portable) names.push_back(VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME);
    const bool debug = contains(offered, VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    if (debug) names.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    if (validation) names.push_back(VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME);

    VkApplicationInfo application{};
    application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
    application.pApplicationName = "darb";
    application.apiVersion = VK_API_VERSION_1_3;

    const VkValidationFeatureEnableEXT synchronization =
        VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
    VkValidationFeaturesEXT features{};
    features.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT;
    features.enabledValidationFeatureCount = 1;
    features.pEnabledValidationFeatures = &synchronization;

    VkInstanceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    info.pApplicationInfo = &application;
    // Else the loader leaves out drivers over another interface, such as MoltenVK.
    if (portable) info.flags |= VK_INSTANCE_CREATE_ENUMERATE_PORTABILITY_BIT_KHR;
    info.enabledExtensionCount = static_cast<std::uint32_t>(names.size());
    info.ppEnabledExtensionNames = names.data();
    if (validation) {
        info.pNext = &features;
        info.enabledLayerCount = 1;
        info.ppEnabledLayerNames = &kValidationLayer;
    }
    check_vulkan(vkCreateInstance(&info, nullptr, &instance_), "Vulkan instance");
    keep_drivers_loaded(application, portable);
    if (debug) load_debug(validation);
}

void Instance::load_debug(bool validation) {
    const auto load = [&](const char* name) { return vkGetInstanceProcAddr(instance_, name); };
    debug_.set_name =
        reinterpret_cast<PFN_vkSetDebugUtilsObjectNameEXT>(load("vkSetDebugUtilsObjectNameEXT"));
    debug_.begin_label =
        reinterpret_cast<PFN_vkCmdBeginDebugUtilsLabelEXT>(load("vkCmdBeginDebugUtilsLabelEXT"));
    debug_.end_label =
        reinterpret_cast<PFN_vkCmdEndDebugUtilsLabelEXT>(load("vkCmdEndDebugUtilsLabelEXT"));
    if (!validation) return;
    const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
        load("vkCreateDebugUtilsMessengerEXT"));
    const VkDebugUtilsMessengerCreateInfoEXT messenger = messenger_info(messages_.get());
    if (create != nullptr) create(instance_, &messenger, nullptr, &messenger_);
}

Instance::~Instance() {
    if (messenger_ != VK_NULL_HANDLE) {
        const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
            vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
        destroy(instance_, messenger_, nullptr);
    }
    if (instance_ != VK_NULL_HANDLE) vkDestroyInstance(instance_, nullptr);
}

std::vector<VkPhysicalDevice> Instance::physical_devices() const {
    std::uint32_t count = 0;
    check_vulkan(vkEnumeratePhysicalDevices(instance_, &count, nullptr), "listing devices");
    std::vector<VkPhysicalDevice> all(count);
    const VkResult result = vkEnumeratePhysicalDevices(instance_, &count, all.data());
    if (result != VK_INCOMPLETE) check_vulkan(result, "listing devices");
    all.resize(count);
    return all;
}

}  // namespace darb
