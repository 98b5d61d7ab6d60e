// SPDX-License-Identifier: MIT
// BarrierTracker: which buffers were written and read by what, and the memory barrier that the next
// pass needs. One barrier orders everything before it, not a buffer alone: so drivers carry out
// barriers of buffers, too, and passes that share nothing may then run side by side. It knows whole
// buffers only. Private to engine/gpu.
#pragma once

#include <vulkan/vulkan.h>
#include <optional>
#include <unordered_map>
#include <vector>

namespace darb {

struct BufferUse {
    VkBuffer buffer = VK_NULL_HANDLE;
    VkPipelineStageFlags2 stage = 0;
    VkAccessFlags2 read = 0;   // 0 = no read
    VkAccessFlags2 write = 0;  // 0 = no write
};

class BarrierTracker {
  public:
    /// Forgets everything: what came before is ordered by other means.
    void clear();

    /// Adds one use of the pass that comes next; uses of one buffer are merged.
    void use(const BufferUse& use);

    /// The barrier that the uses added since the last call need (RAW, WAR, WAW), if any.
    std::optional<VkMemoryBarrier2> resolve();

    /// The barrier that makes all writes so far visible to the host; none where nothing was
    /// written.
    std::optional<VkMemoryBarrier2> to_host() const;

  private:
    struct State {
        bool written = false, read = false;
        VkPipelineStageFlags2 readers = 0;  // stages that a barrier after the last write reached
        VkPipelineStageFlags2 writers = 0;  // the same after the last use of any kind
    };
    std::unordered_map<VkBuffer, State> states_;
    std::vector<BufferUse> pending_;
    VkPipelineStageFlags2 stages_ = 0;  // stages of all uses so far
    VkAccessFlags2 writes_ = 0;
};

// The barrier between submissions of whoever recorded them.

/// After it everything that was written before it is visible to what follows.
VkMemoryBarrier2 full_barrier();
void record_barrier(VkCommandBuffer commands, const VkMemoryBarrier2& barrier);

}  // namespace darb
