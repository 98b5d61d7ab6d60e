#include "engine/gpu/barriers.h"

#include <algorithm>

namespace darb {

namespace {

VkBufferMemoryBarrier2 whole_buffer(VkBuffer buffer) {
    VkBufferMemoryBarrier2 barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_BUFFER_MEMORY_BARRIER_2;
    barrier.srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.buffer = buffer;
    barrier.size = VK_WHOLE_SIZE;
    return barrier;
}

}  // namespace

void BarrierTracker::use(const BufferUse& use) {
    const auto same = std::find_if(pending_.begin(), pending_.end(), [&](const BufferUse& other) {
        return other.buffer == use.buffer;
    });
    if (same == pending_.end()) {
        pending_.push_back(use);
        return;
    }
    same->stage |= use.stage;
    same->read |= use.read;
    same->write |= use.write;
}

const std::vector<VkBufferMemoryBarrier2>& BarrierTracker::resolve() {
    barriers_.clear();
    for (const BufferUse& use : pending_) {
        State& state = states_[use.buffer];
        const bool seen = (state.visible_stages & use.stage) == use.stage &&
                          (state.visible_access & use.read) == use.read;
        const bool after_write = state.write_stage != 0 && (use.write != 0 || !seen);
        const bool after_read = state.read_stages != 0 && use.write != 0;
        if (after_write || after_read) {
            VkBufferMemoryBarrier2 barrier = whole_buffer(use.buffer);
            barrier.srcStageMask = state.write_stage | (use.write != 0 ? state.read_stages : 0);
            barrier.srcAccessMask = state.write_access;
            barrier.dstStageMask = use.stage;
            barrier.dstAccessMask = use.read | use.write;
            barriers_.push_back(barrier);
        }
        if (use.write != 0) {
            state = {use.stage, use.write, 0, 0, 0};
        } else {
            state.read_stages |= use.stage;
            state.visible_stages |= use.stage;
            state.visible_access |= use.read;
        }
    }
    pending_.clear();
    return barriers_;
}

std::vector<VkBufferMemoryBarrier2> BarrierTracker::to_host() const {
    std::vector<VkBufferMemoryBarrier2> all;
    for (const auto& [buffer, state] : states_) {
        if (state.write_stage == 0) continue;
        VkBufferMemoryBarrier2 barrier = whole_buffer(buffer);
        barrier.srcStageMask = state.write_stage;
        barrier.srcAccessMask = state.write_access;
        barrier.dstStageMask = VK_PIPELINE_STAGE_2_HOST_BIT;
        barrier.dstAccessMask = VK_ACCESS_2_HOST_READ_BIT;
        all.push_back(barrier);
    }
    return all;
}

}  // namespace darb
