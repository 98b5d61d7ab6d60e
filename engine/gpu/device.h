// SPDX-License-Identifier: MIT
// Device: one Vulkan 1.3 device with one compute queue, no window system needed. engine/gpu knows
// buffers, pipelines and commands; nothing of splats. What the environment asks for (validation,
// faults, tuning) is read by commands and tests and handed down in options.
#pragma once

#include <vulkan/vulkan.h>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/gpu/faults.h"
#include "engine/gpu/pipeline_statistics.h"
#include "engine/gpu/shader_table.h"

namespace darb {

struct DeviceInfo;

enum class BackwardBlend {
    subgroup,  // a subgroup walks a tile's list, reductions over its pixels: blend_backward.comp
    team,      // the same with a subgroup for each area of the tile: blend_backward_team.comp
    buckets,   // a thread owns an intersection, from checkpoints: blend_backward_buckets.comp
    pixels,    // as a team, sums by pixels of 8 splats at a time: blend_backward_pixels.comp
    pixels4,   // the same with 4 at a time, which takes less shared memory
};

/// Names in the order of the enum.
inline constexpr const char* kBackwardBlends[] = {"subgroup", "team", "buckets", "pixels",
                                                  "pixels4"};

constexpr bool is_by_pixels(BackwardBlend form) {
    return form == BackwardBlend::pixels || form == BackwardBlend::pixels4;
}
/// Whether this form writes the sums of every intersection, zeros included; others add to what is
/// there.
constexpr bool writes_every_slot(BackwardBlend form) {
    return form == BackwardBlend::team || is_by_pixels(form);
}

/// How the scatter pass of the radix sort ranks keys, shaders/sort/radix_scatter_*; in the order of
/// their names.
enum class SortScatter { ballot, columns };
inline constexpr const char* kSortScatters[] = {"ballot", "columns"};

/// How the loss walks a picture: loss/loss.comp, or loss/loss_maps.comp and loss_gradient.comp; in
/// the order of their names.
enum class LossWay { strips, tiles };
inline constexpr const char* kLossWays[] = {"strips", "tiles"};

/// Where training photos lie: where the plan of memory says; on the device; on the host, from where
/// each is copied for its step. In the order of their names.
enum class PhotoPlace { automatic, resident, streamed };
inline constexpr const char* kPhotoPlaces[] = {"auto", "resident", "streamed"};

/// Each chooses a specialization constant or a shader, except for the photos' place.
struct Tuning {
    bool scan_by_thread = false;  // Scan::Strategy::team_is_thread
    SortScatter scatter = SortScatter::ballot;
    std::uint32_t blend_threads = 0;  // size of the forward blend's workgroup, which has a tile
    // Whether the forward blend goes by records of splats in shared memory, a subgroup for each
    // block of the tile: blend_records.comp, where that can be used (Forward::blends_records).
    bool blend_records = false;
    std::uint32_t blend_lanes = 0;  // lanes of a subgroup in both blends; 0: the device's own
    BackwardBlend backward = BackwardBlend::subgroup;
    LossWay loss = LossWay::strips;
    bool count_lists = false;     // lists of tiles by one counting pass: TileLists
    bool short_depths = false;    // depth keys of SHORT_DEPTH_BITS, sorted by three digits
    bool emit_by_slots = false;   // a thread for each intersection: emit_slots.comp
    bool sums_by_chunks = false;  // of the partials of large splats: partial_chunks.comp
    bool longest_first =
        false;  // the blends take the tiles by the lengths of their lists: tile_order.comp
    bool exp_builtin = false;  // use the driver's own exp where kernels may (kEvaluationOfDevice)
    PhotoPlace photos = PhotoPlace::automatic;
    bool operator==(const Tuning&) const = default;
};

/// Lanes of the subgroups of BackwardBlend::pixels, which are 32 at most: chosen where that fits,
/// else 32. 0 where the device has no such subgroups, or less than 32 KiB of shared memory.
std::uint32_t lanes_by_pixels(const DeviceInfo& info, std::uint32_t chosen);

/// The tuning that a device begins with: on lavapipe the one measured by hand for each of its
/// vector widths.
Tuning usual_tuning(const DeviceInfo& info);

/// What `darb devices` prints, and what the choice is made from.
struct DeviceInfo {
    int index = 0;                     // what --device N takes
    std::string name;                  // what --device NAME matches, case-insensitive, any part
    std::string driver;                // name and version
    std::uint32_t driver_version = 0;  // as the driver counts
    std::string cache_uuid;            // pipelineCacheUUID in hex: another one, other machine code
    std::string type;                  // discrete, integrated, virtual, cpu, other
    bool conformant = true;            // the driver claims to pass Vulkan's conformance tests
    std::uint32_t api_version = 0;
    std::uint64_t heap_bytes = 0;                // largest device-local heap
    std::uint64_t max_storage_buffer_bytes = 0;  // maxStorageBufferRange
    std::uint64_t max_allocation_bytes = 0;      // the most that one buffer may have
    std::uint32_t max_storage_buffers = 0;       // per stage
    std::uint32_t max_workgroup_threads = 0;
    std::uint32_t shared_memory_bytes = 0;
    std::uint32_t max_groups_x = 0;
    std::uint32_t subgroup_size = 0, min_subgroup_size = 0, max_subgroup_size = 0;
    bool requires_subgroup_size = false;  // compute shaders may ask for one of several sizes
    double timestamp_period_ns = 0;       // 0 where the queue has no timestamps
    bool unified_memory = false;          // every heap is host-visible (CPU and integrated devices)
    bool float_atomics = false;           // float32 atomic add on buffers
    bool half_arithmetic = false;         // shaderFloat16, for the blends of fast16
    bool usable = false;
    std::string reason;  // why it was rejected, or why it ranks where it does
};

/// Leaves the sizes that pipelines can have: where shaders cannot require one, all have the
/// device's own (MoltenVK on Apple's GPUs: 32, of 4 to 32).
void keep_subgroup_sizes(DeviceInfo& info);
/// Why the blend passes, which want 4 to 64 lanes, cannot run in the subgroups of a device, or "".
std::string subgroup_trouble(const DeviceInfo& info);

/// Every physical device, best first; never throws for want of a device (then: empty).
std::vector<DeviceInfo> list_devices();

/// Position in devices of what --device SELECT means: "" = best usable, all digits = index, else
/// part of a name (the best usable match). Throws Error: none, none usable, no match, not usable.
std::size_t choose_device(const std::vector<DeviceInfo>& devices, const std::string& select);

/// A device and its driver on one line of text; others: names of the other usable ones.
std::string describe_choice(const DeviceInfo& chosen, const std::vector<std::string>& others);

struct DeviceOptions {
    std::string select;       // "" = best usable; a number = index; else part of a name
    bool validation = false;  // core + synchronization validation
    Faults faults;            // injected for tests
    /// Nothing is given to the queue: what is downloaded is 0. Pipelines are compiled anew, past
    /// every cache, and Device::compiled says what the driver tells of them.
    bool compile_only = false;
    /// A pipeline lives as long as the device, even while nothing uses it: for programs that keep
    /// making and dropping renderers.
    bool keep_pipelines = false;
    /// Compiled pipelines and the record of the tuner are kept there; "" = nowhere.
    std::filesystem::path cache_folder;
    /// For a window: surface extensions of the instance, VK_KHR_swapchain of the device. A name
    /// that is not offered is an Error. The queue does graphics too wherever the device has such a
    /// queue.
    std::vector<std::string> instance_extensions;
    std::vector<std::string> device_extensions;
};

class Device {
  public:
    /// Throws Error: no loader, no device, no usable device (each with its reason), bad --device.
    explicit Device(const DeviceOptions& options = {});
    ~Device();  // writes the pipeline cache
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    const DeviceInfo& info() const;
    std::string description() const;  // as describe_choice
    bool is_lavapipe() const;
    VkInstance instance() const;
    VkPhysicalDevice physical() const;
    VkDevice handle() const;
    VkQueue queue() const;  // under no lock: give it work by Commands::submit and present()
    std::uint32_t queue_family() const;
    bool queue_has_graphics() const;
    VkPipelineCache pipeline_cache() const;

    /// Where the pipeline cache lies and whatever else was measured of this device; "" = nowhere.
    const std::filesystem::path& cache_folder() const;

    /// Applies to all objects that are made for this device from now on; usual_tuning() at first.
    void set_tuning(const Tuning& tuning);
    const Tuning& tuning() const;

    /// Bytes of live Buffers, and the most there ever were.
    std::uint64_t allocated_bytes() const;
    std::uint64_t peak_bytes() const;
    void forget_peak();  // peak_bytes counts from now on
    /// A budget for all Buffers together; 0 = none. Exceeding it throws NoRoom.
    void set_memory_budget(std::uint64_t bytes);
    std::uint64_t memory_budget() const;

    /// With compile_only, every pipeline that was made, in order.
    const std::vector<CompiledPipeline>& compiled() const;
    /// Whether the driver has statistics of pipelines.
    bool has_pipeline_statistics() const;

    /// Messages of the validation layers since the start (0 where validation is off).
    std::uint64_t validation_message_count() const;

    void wait_idle() const;
    /// vkQueuePresentKHR, in turn with what other threads give to the queue.
    VkResult present(const VkPresentInfoKHR& info) const;

    struct State;  // private to engine/gpu
    State& state() const { return *state_; }

  private:
    std::unique_ptr<State> state_;
};

/// Throws an error that names WHAT for every result but VK_SUCCESS: NoRoom where memory ran out,
/// DeviceLost, or Error.
void check_vulkan(VkResult result, const std::string& what);

// The device of a command: what --device says, and the environment: DARB_VALIDATION=1 turns the
// validation layers on, DARB_FAULT injects faults for tests (engine/gpu/faults.h), compiled shaders
// are kept in the user's cache folder.

/// Sets MESA_SHADER_CACHE_DIR where nothing has set it. Throws Error where DARB_FAULT names no
/// fault.
DeviceOptions command_device(const std::string& select);

// What the shaders of the table need of a device, read from the capabilities of their SPIR-V: so
// that a device is asked for no more, and one that is refused learns which shader it fails. Private
// to engine/gpu.

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
/// The needs of all shaders in the embedded table, which is read once per process. What only
/// shaders of half precision need is left out, as a device may lack it
/// (DeviceInfo::half_arithmetic).
const std::vector<ShaderNeed>& needs_of_all_shaders();

/// Turns on what these needs and this project's own Vulkan calls take, nothing else: robust access,
/// for one, would cost time.
void want_features(const std::vector<ShaderNeed>& needs, DeviceFeatures& wanted);

/// What is missing first, and who needs it ("no shaderInt64, which shader x needs"); "" where a
/// device offers all.
std::string missing_feature(const std::vector<ShaderNeed>& needs, DeviceFeatures& offered,
                            VkSubgroupFeatureFlags subgroup_operations);

}  // namespace darb
