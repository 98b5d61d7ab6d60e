// BarrierTracker: which buffers were written and read by what since the last barrier, and the
// barriers that the next pass needs. Whole buffers only. Private to engine/gpu.
#pragma once

#include <vulkan/vulkan.h>

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
    void clear() { states_.clear(); }

    /// Adds one use of the pass that comes next; uses of one buffer are merged.
    void use(const BufferUse& use);

    /// The barriers that the uses added since the last call need (RAW, WAR, WAW), one per buffer.
    /// Valid until the next call.
    const std::vector<VkBufferMemoryBarrier2>& resolve();

    /// Barriers that make all writes so far visible to the host.
    std::vector<VkBufferMemoryBarrier2> to_host() const;

  private:
    struct State {
        VkPipelineStageFlags2 write_stage = 0;  // of the last write, 0 = none
        VkAccessFlags2 write_access = 0;
        VkPipelineStageFlags2 read_stages = 0;     // readers since that write
        VkPipelineStageFlags2 visible_stages = 0;  // where that write was made visible
        VkAccessFlags2 visible_access = 0;
    };
    std::unordered_map<VkBuffer, State> states_;
    std::vector<BufferUse> pending_;
    std::vector<VkBufferMemoryBarrier2> barriers_;
};

}  // namespace darb
