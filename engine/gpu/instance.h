// Instance: the Vulkan instance with validation and debug labels where asked for and offered.
// Private to engine/gpu.
#pragma once

#include <vulkan/vulkan.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace darb {

/// Entry points of VK_EXT_debug_utils, null where it is missing.
struct DebugUtils {
    PFN_vkSetDebugUtilsObjectNameEXT set_name = nullptr;
    PFN_vkCmdBeginDebugUtilsLabelEXT begin_label = nullptr;
    PFN_vkCmdEndDebugUtilsLabelEXT end_label = nullptr;
};

class Instance {
  public:
    /// Throws Error: no driver, validation asked for but not installed, an extension not offered.
    Instance(bool validation, const std::vector<std::string>& extensions);
    ~Instance();
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    VkInstance handle() const { return instance_; }
    const DebugUtils& debug() const { return debug_; }
    std::uint64_t message_count() const { return *messages_; }
    std::vector<VkPhysicalDevice> physical_devices() const;

  private:
    void load_debug(bool validation);  // and begin to listen to the layers

    VkInstance instance_ = VK_NULL_HANDLE;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    DebugUtils debug_;
    std::unique_ptr<std::atomic<std::uint64_t>> messages_;
};

}  // namespace darb
