// SPDX-License-Identifier: MIT
#include "engine/gpu/device_state.h"

#include <fmt/format.h>
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <initializer_list>
#include <iterator>
#include <utility>

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
