// SPDX-License-Identifier: MIT
#include "engine/gpu/barriers.h"

#include <algorithm>

namespace darb {

namespace {

// Every access of a stage, so that one barrier does for all buffers.
VkAccessFlags2 accesses_of(VkPipelineStageFlags2 stages) {
    VkAccessFlags2 accesses = 0;
    if (stages & VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT)
        accesses |= VK_ACCESS_2_SHADER_STORAGE_READ_BIT | VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT;
    if (stages & VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT)
        accesses |= VK_ACCESS_2_TRANSFER_READ_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT;
    if (stages & VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT)
        accesses |= VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT;
    return accesses;
}

VkMemoryBarrier2 memory_barrier() {
    VkMemoryBarrier2 barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2;
    return barrier;
}

}  // namespace

void BarrierTracker::clear() {
    states_.clear();
    pending_.clear();  // left by a pass that was refused before it was resolved
    stages_ = 0;
    writes_ = 0;
}

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

std::optional<VkMemoryBarrier2> BarrierTracker::resolve() {
    VkPipelineStageFlags2 reached = 0;
    for (const BufferUse& use : pending_) {
        const State& state = states_[use.buffer];
        const bool reads_early = state.written && (state.readers & use.stage) != use.stage;
        const bool writes_early = use.write != 0 && (state.written || state.read) &&
                                  (state.writers & use.stage) != use.stage;
        if (reads_early || writes_early) reached |= use.stage;
    }
    std::optional<VkMemoryBarrier2> barrier;
    if (reached != 0) {
        barrier = memory_barrier();
        barrier->srcStageMask = stages_;
        barrier->srcAccessMask = writes_;
        barrier->dstStageMask = reached;
        barrier->dstAccessMask = accesses_of(reached);
        for (auto& [buffer, state] : states_) {
            state.readers |= reached;
            state.writers |= reached;
        }
    }
    for (const BufferUse& use : pending_) {
        State& state = states_[use.buffer];
        state.writers = 0;
        if (use.read != 0) state.read = true;
        if (use.write != 0) {
            state.written = true;
            state.readers = 0;
        }
        stages_ |= use.stage;
        writes_ |= use.write;
    }
    pending_.clear();
    return barrier;
}

std::optional<VkMemoryBarrier2> BarrierTracker::to_host() const {
    if (writes_ == 0) return {};
    VkMemoryBarrier2 barrier = memory_barrier();
    barrier.srcStageMask = stages_;
    barrier.srcAccessMask = writes_;
    barrier.dstStageMask = VK_PIPELINE_STAGE_2_HOST_BIT;
    barrier.dstAccessMask = VK_ACCESS_2_HOST_READ_BIT;
    return barrier;
}

VkMemoryBarrier2 full_barrier() {
    VkMemoryBarrier2 barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2;
    barrier.srcStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
    barrier.srcAccessMask = VK_ACCESS_2_MEMORY_WRITE_BIT;
    barrier.dstStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
    barrier.dstAccessMask = VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT;
    return barrier;
}

void record_barrier(VkCommandBuffer commands, const VkMemoryBarrier2& barrier) {
    VkDependencyInfo dependency{};
    dependency.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
    dependency.memoryBarrierCount = 1;
    dependency.pMemoryBarriers = &barrier;
    vkCmdPipelineBarrier2(commands, &dependency);
}

}  // namespace darb
