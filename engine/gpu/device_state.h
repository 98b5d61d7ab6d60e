// SPDX-License-Identifier: MIT
// What Buffer, Pipeline and Commands share of a Device. Private to engine/gpu.
#pragma once

#include <vulkan/vulkan.h>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/device.h"
#include "engine/gpu/faults.h"
#include "engine/gpu/pipeline.h"

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

class DeviceMemory;

/// One physical device, as listed.
struct ListedDevice {
    VkPhysicalDevice handle = VK_NULL_HANDLE;
    DeviceInfo info;
};

/// All devices, best first, indices set.
/// Throws Error where Vulkan's loader, which comes with the driver, is missing: on Windows alone,
/// as elsewhere the program does not start without it.
void check_vulkan_loader();
std::vector<ListedDevice> list_devices(const Instance& instance);

std::string hex(std::span<const std::uint8_t> bytes);

/// The queue family that does compute, with graphics too if there is one; -1 = none.
int compute_queue_family(VkPhysicalDevice device);

/// The shaders that bind the most storage buffers: of a rendering, and of all.
constexpr std::string_view kRendering = "project", kTraining = "project_backward";
/// The most that a shader may bind. MoltenVK has 31 places for buffers, of which it takes one for
/// push constants and others for what Metal cannot tell a shader.
constexpr std::uint32_t kMostStorageBuffers = 28;
/// What a shader binds of them.
std::uint32_t storage_buffers(std::string_view shader);
/// Why a device cannot run this shader for want of them, or "".
std::string buffers_trouble(const DeviceInfo& info, std::string_view shader);

/// The bytes of a pipeline cache file, or nothing where it is missing, broken or of another device.
std::vector<std::byte> load_pipeline_cache(const std::filesystem::path& file);
/// Errors are ignored: a cache that cannot be written only costs time.
void save_pipeline_cache(const std::filesystem::path& file, std::span<const std::byte> data);

struct Device::State {
    explicit State(const DeviceOptions& options, bool validation);
    ~State();
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    Instance instance;
    Faults faults;
    DeviceInfo info;
    std::vector<std::string> others;  // names of the other usable devices
    Tuning tuning;
    bool lavapipe = false;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkPhysicalDeviceMemoryProperties memory{};
    VkPhysicalDeviceLimits limits{};
    std::uint32_t timestamp_bits = 0;
    std::uint32_t queue_family = 0;
    bool queue_graphics = false;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    std::mutex queue_mutex;  // queues are externally synchronised
    bool submitted = false;  // whether work was, since the last wait for all; under queue_mutex
    std::filesystem::path cache_folder, cache_file;
    std::size_t loaded_cache_bytes = 0;
    VkPipelineCache cache = VK_NULL_HANDLE;

    PipelineTable pipelines;
    std::unique_ptr<DeviceMemory> device_memory;  // while there is a device

    bool compile_only = false;
    struct {  // functions of VK_KHR_pipeline_executable_properties, null without it
        PFN_vkGetPipelineExecutablePropertiesKHR properties = nullptr;
        PFN_vkGetPipelineExecutableStatisticsKHR statistics = nullptr;
    } executable;
    std::vector<CompiledPipeline> compiled;
    /// Adds what the driver says of a pipeline to `compiled`.
    void note_compiled(VkPipeline pipeline, CompiledPipeline row);

    std::atomic<std::uint64_t> allocated{0}, peak{0}, budget{0}, submits{0};

    /// Where staging copies run, one at a time and from any thread; made at the first use.
    std::mutex copy_mutex;
    VkCommandPool copy_pool = VK_NULL_HANDLE;
    VkCommandBuffer copy_commands = VK_NULL_HANDLE;

    void set_name(VkObjectType type, std::uint64_t handle, const std::string& name) const;
    /// One submit under the mutex, with the fault injection, which counts it. The semaphores may
    /// be null.
    VkResult submit(VkCommandBuffer commands, VkFence fence, VkSemaphore wait_for = VK_NULL_HANDLE,
                    VkSemaphore signal = VK_NULL_HANDLE);
    /// The same for a staging copy, which the fault injection does not count.
    VkResult submit_copy(VkCommandBuffer commands);
    VkResult wait_idle();
    /// The same where work was submitted since the last wait: the call alone takes 40 us on
    /// lavapipe.
    VkResult wait_for_submitted();
    /// Records one copy, runs it and waits.
    void copy_now(VkBuffer from, std::uint64_t from_offset, VkBuffer to, std::uint64_t to_offset,
                  std::uint64_t bytes, const std::string& what);

  private:
    VkResult give_to_queue(VkCommandBuffer commands, VkFence fence, VkSemaphore wait_for,
                           VkSemaphore signal);
    void create_device(const DeviceOptions& options);
    void load_statistics();
    void create_cache(const DeviceOptions& options);
    void release() noexcept;
};

// Memory of buffers and images: which type of the device's they get, and the blocks that small ones
// share, as some drivers allow 4,096 allocations at once. Private to engine/gpu.

inline constexpr VkMemoryPropertyFlags kMappable =
    VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
inline constexpr VkMemoryPropertyFlags kCached = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;

struct MemoryBlock;

/// An allocation of its own, or a part of a block.
struct MemoryPiece {
    VkDeviceMemory handle = VK_NULL_HANDLE;
    VkDeviceSize offset = 0, bytes = 0;
    VkMemoryPropertyFlags flags = 0;
    void* mapped = nullptr;        // its first byte, where the host may map it
    MemoryBlock* block = nullptr;  // null: an allocation of its own
};

struct MemoryBlock {
    MemoryPiece whole;
    int type = 0;
    std::map<VkDeviceSize, VkDeviceSize> free;  // offset -> bytes, never two side by side
    bool empty() const { return free.size() == 1 && free.begin()->second == whole.bytes; }
};

class DeviceMemory {
  public:
    explicit DeviceMemory(const Device::State& state) : state_(state) {}
    ~DeviceMemory();  // all pieces are back
    DeviceMemory(const DeviceMemory&) = delete;
    DeviceMemory& operator=(const DeviceMemory&) = delete;

    /// Memory for a buffer; from any thread. what: its name in errors. Throws NoRoom where there is
    /// not enough.
    MemoryPiece take(const VkMemoryRequirements& needs, Memory kind, const std::string& what);
    /// The same for an image, never from a block: beside buffers, images need other alignments.
    MemoryPiece take_own(const VkMemoryRequirements& needs, Memory kind, const std::string& what);
    void give_back(MemoryPiece& piece) noexcept;

    /// How many allocations of the driver's are alive: blocks, and pieces with their own memory.
    std::uint32_t allocations() const { return allocations_; }

  private:
    int choose_type(std::uint32_t allowed, Memory kind, const std::string& what) const;
    VkResult allocate(VkDeviceSize bytes, int type, MemoryPiece& piece);
    void free(VkDeviceMemory handle) noexcept;
    MemoryPiece take_own_locked(const VkMemoryRequirements& needs, int type,
                                const std::string& what);
    bool take_shared(const VkMemoryRequirements& needs, int type, MemoryPiece& piece);
    MemoryBlock* add_block(int type);
    void free_empty_blocks() noexcept;

    const Device::State& state_;
    std::mutex mutex_;
    std::list<MemoryBlock> blocks_;
    std::uint32_t allocations_ = 0;
};

}  // namespace darb
