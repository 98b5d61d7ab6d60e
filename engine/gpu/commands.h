// SPDX-License-Identifier: MIT
// Commands: records passes one statement each, with barriers derived from what each pass reads and
// writes, and runs them. Each pass() is a debug label and a pair of timestamps.
#pragma once

#include <vulkan/vulkan.h>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/device.h"
#include "engine/gpu/device_image.h"
#include "engine/gpu/pipeline.h"

namespace darb {

struct PassTime {
    std::string name;
    double ms = 0;
};

/// What the recording of a pass() holds; a barrier is one command, however many buffers it names.
struct RecordedPass {
    std::string name;
    std::uint32_t dispatches = 0, barriers = 0, descriptors = 0;
};

/// For shaders without a push constant block.
struct NoArgs {};

class Commands {
  public:
    explicit Commands(Device& device);
    ~Commands();
    Commands(Commands&&) noexcept;
    Commands& operator=(Commands&&) noexcept;

    /// Starts a new recording. The last submission must have been waited for.
    void begin();

    /// Everything recorded until the next pass() belongs to this name.
    void pass(std::string_view name);

    /// One dispatch. args: the pass's argument struct, whose size must equal the shader's push
    /// constant block. buffers: set 0, binding 0.., as many as the shader declares. groups >= 1 in
    /// each used dimension; a dimension above the device's limit is a check failure.
    /// Memory barriers are placed here: a pass waits for the earlier writers of what it touches,
    /// and a writer for the earlier readers. Ranges of one buffer count as the whole buffer. What
    /// is recorded between two barriers may run side by side.
    template <class Args>
    void dispatch(const Pipeline& pipeline, const Args& args,
                  std::initializer_list<BufferRange> buffers, std::uint32_t groups_x,
                  std::uint32_t groups_y = 1, std::uint32_t groups_z = 1) {
        dispatch_bytes(pipeline, std::as_bytes(std::span(&args, 1)),
                       std::span(buffers.begin(), buffers.size()), groups_x, groups_y, groups_z);
    }
    template <class Args>
    void dispatch(const Pipeline& pipeline, const Args& args, std::span<const BufferRange> buffers,
                  std::uint32_t groups_x, std::uint32_t groups_y = 1, std::uint32_t groups_z = 1) {
        dispatch_bytes(pipeline, std::as_bytes(std::span(&args, 1)), buffers, groups_x, groups_y,
                       groups_z);
    }
    /// The same with VkDispatchIndirectCommand read from indirect at offset (bytes).
    template <class Args>
    void dispatch_indirect(const Pipeline& pipeline, const Args& args,
                           std::initializer_list<BufferRange> buffers, const Buffer& indirect,
                           std::uint64_t offset) {
        dispatch_indirect_bytes(pipeline, std::as_bytes(std::span(&args, 1)),
                                std::span(buffers.begin(), buffers.size()), indirect, offset);
    }
    void dispatch_bytes(const Pipeline&, std::span<const std::byte> args,
                        std::span<const BufferRange> buffers, std::uint32_t groups_x,
                        std::uint32_t groups_y, std::uint32_t groups_z);
    void dispatch_indirect_bytes(const Pipeline&, std::span<const std::byte> args,
                                 std::span<const BufferRange> buffers, const Buffer& indirect,
                                 std::uint64_t offset);

    void fill(const BufferRange& range, std::uint32_t word);  // size and offset multiples of 4
    void copy(const BufferRange& from, const BufferRange& to, std::uint64_t bytes);

    /// Whole images, each after all that was recorded before it. Buffers hold [height][width]
    /// texels.
    void clear(DeviceImage& image, const std::array<float, 4>& colour);
    void copy(const Buffer& from, DeviceImage& to);
    void copy(DeviceImage& from, const Buffer& to);
    /// Scaled with this filter where the sizes differ, converted where the formats do.
    void copy(DeviceImage& from, DeviceImage& to, VkFilter filter);
    /// Prepares the image for what others do with it; its contents stay.
    void change_layout(DeviceImage& image, VkImageLayout layout);
    /// For commands that others record between begin() and submit().
    VkCommandBuffer handle() const;

    /// Ends the recording and gives it to the queue; host reads of Memory::host buffers are made
    /// visible. Does not wait. It begins after wait_for and ends with signal; either may be null.
    void submit(VkSemaphore wait_for = VK_NULL_HANDLE, VkSemaphore signal = VK_NULL_HANDLE);
    /// Blocks (no spinning) until the last submit is done. Throws DeviceLost.
    void wait();
    /// Whether wait() would return at once; also where the device is lost, which wait() says.
    bool done() const;
    void submit_and_wait() {
        submit();
        wait();
    }

    /// The passes recorded since begin(), in order.
    const std::vector<RecordedPass>& recorded() const;

    /// After wait(): one row per pass() in order of recording, empty if timestamps are off.
    std::vector<PassTime> pass_times() const;

  private:
    void overwrite(DeviceImage& image);
    struct State;
    std::unique_ptr<State> state_;
};

// Timestamps: query pools that grow with the number of passes of a recording. Private to
// engine/gpu.

/// Ticks between two values of a counter of which the lowest `bits` (1 to 64) are valid.
constexpr std::uint64_t tick_difference(std::uint64_t from, std::uint64_t to, std::uint32_t bits) {
    return (to - from) & (bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1);
}

class Timestamps {
  public:
    explicit Timestamps(VkDevice device) : device_(device) {}
    ~Timestamps();
    Timestamps(const Timestamps&) = delete;
    Timestamps& operator=(const Timestamps&) = delete;

    void restart() { count_ = 0; }
    /// Writes a timestamp once all earlier commands are done.
    void write(VkCommandBuffer commands);
    /// The ticks of all timestamps since restart(); the recording must have run.
    std::vector<std::uint64_t> read() const;

  private:
    VkDevice device_;
    std::vector<VkQueryPool> pools_;
    std::uint32_t count_ = 0;
};

}  // namespace darb
