#include "engine/gpu/timestamps.h"

#include <algorithm>

#include "engine/gpu/device.h"

namespace darb {

namespace {
constexpr std::uint32_t kPoolSize = 128;
}

Timestamps::~Timestamps() {
    for (VkQueryPool pool : pools_) vkDestroyQueryPool(device_, pool, nullptr);
}

void Timestamps::write(VkCommandBuffer commands) {
    const std::uint32_t pool = count_ / kPoolSize;
    if (pool == pools_.size()) {
        VkQueryPoolCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
        info.queryType = VK_QUERY_TYPE_TIMESTAMP;
        info.queryCount = kPoolSize;
        VkQueryPool handle = VK_NULL_HANDLE;
        check_vulkan(vkCreateQueryPool(device_, &info, nullptr, &handle), "timestamps");
        pools_.push_back(handle);
    }
    if (count_ % kPoolSize == 0) vkCmdResetQueryPool(commands, pools_[pool], 0, kPoolSize);
    vkCmdWriteTimestamp2(commands, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, pools_[pool],
                         count_ % kPoolSize);
    ++count_;
}

std::vector<std::uint64_t> Timestamps::read() const {
    std::vector<std::uint64_t> ticks(count_);
    for (std::uint32_t first = 0; first < count_; first += kPoolSize) {
        const std::uint32_t n = std::min(kPoolSize, count_ - first);
        check_vulkan(
            vkGetQueryPoolResults(device_, pools_[first / kPoolSize], 0, n, n * sizeof(ticks[0]),
                                  ticks.data() + first, sizeof(ticks[0]),
                                  VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
            "timestamps");
    }
    return ticks;
}

}  // namespace darb
