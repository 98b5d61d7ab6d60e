#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/gpu/device.h"

namespace darb {

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

}  // namespace darb
