// SPDX-License-Identifier: MIT
#include "engine/gpu/commands.h"

#include <fmt/format.h>
#include <algorithm>
#include <utility>

#include "engine/core/error.h"
#include "engine/gpu/barriers.h"
#include "engine/gpu/device.h"
#include "engine/gpu/device_state.h"

namespace darb {

namespace {

constexpr std::uint32_t kSetsPerPool = 256;
constexpr std::uint32_t kBindingsPerPool = 8 * kSetsPerPool;

constexpr VkPipelineStageFlags2 kCompute = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT;
// Not CLEAR and COPY: validation layers before 1.3.250 take a fill for a copy.
constexpr VkPipelineStageFlags2 kTransfer = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;

constexpr VkImageSubresourceRange kWholeColour{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
constexpr VkImageSubresourceLayers kColourLayer{VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
constexpr VkImageLayout kSource = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
constexpr VkImageLayout kTarget = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;

VkExtent3D extent_of(const DeviceImage& image) {
    return {static_cast<std::uint32_t>(image.width()), static_cast<std::uint32_t>(image.height()),
            1};
}

VkBufferImageCopy whole_image(const DeviceImage& image) {
    VkBufferImageCopy region{};
    region.imageSubresource = kColourLayer;
    region.imageExtent = extent_of(image);
    return region;
}

std::uint64_t bytes_of(const DeviceImage& image) {
    return std::uint64_t(image.width()) * std::uint64_t(image.height()) * 4;
}

bool is_within(std::uint64_t offset, std::uint64_t bytes, std::uint64_t whole) {
    return bytes <= whole && offset <= whole - bytes;
}

void check_recording(bool recording) {
    if (!recording) throw Error("commands", "nothing is being recorded", "Call begin() first.");
}

void check_holds(const Buffer& buffer, const DeviceImage& image) {
    if (buffer.bytes() >= bytes_of(image)) return;
    throw Error(buffer.name(),
                fmt::format("{} bytes for an image of {} x {}", buffer.bytes(), image.width(),
                            image.height()),
                "The buffer holds four bytes a pixel.");
}

}  // namespace

struct Commands::State {
    explicit State(Device& device_) : device(device_), timestamps(device_.handle()) {}
    ~State();
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    Device& device;
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence fence = VK_NULL_HANDLE;
    std::vector<VkDescriptorPool> descriptor_pools;
    std::size_t current_pool = 0;
    BarrierTracker barriers;
    Timestamps timestamps;
    bool timed = false;
    bool recording = false;
    bool in_flight = false;
    std::vector<RecordedPass> passes;

    void create();
    VkDescriptorSet allocate_set(const Pipeline& pipeline);
    void bind(const Pipeline& pipeline, std::span<const std::byte> args,
              std::span<const BufferRange> buffers);
    void place_barriers();
    void write_timestamp();
    void finish_pass();
    RecordedPass unnamed;  // what is recorded before the first pass
    RecordedPass& now() { return passes.empty() ? unnamed : passes.back(); }
    std::string here() const {
        return passes.empty() ? "pass" : "pass \"" + passes.back().name + "\"";
    }
    std::string all_passes() const;
};

Commands::State::~State() {
    VkDevice handle = device.handle();
    if (in_flight) vkWaitForFences(handle, 1, &fence, VK_TRUE, UINT64_MAX);
    for (VkDescriptorPool p : descriptor_pools) vkDestroyDescriptorPool(handle, p, nullptr);
    vkDestroyFence(handle, fence, nullptr);
    vkDestroyCommandPool(handle, pool, nullptr);
}

void Commands::State::create() {
    VkCommandPoolCreateInfo pool_info{};
    pool_info.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool_info.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
    pool_info.queueFamilyIndex = device.queue_family();
    check_vulkan(vkCreateCommandPool(device.handle(), &pool_info, nullptr, &pool), "command pool");
    VkCommandBufferAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    info.commandPool = pool;
    info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    info.commandBufferCount = 1;
    check_vulkan(vkAllocateCommandBuffers(device.handle(), &info, &commands), "command buffer");
    VkFenceCreateInfo fence_info{};
    fence_info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    check_vulkan(vkCreateFence(device.handle(), &fence_info, nullptr, &fence), "fence");
    timed = device.info().timestamp_period_ns > 0 && !device.state().compile_only;
}

VkDescriptorSet Commands::State::allocate_set(const Pipeline& pipeline) {
    const VkDescriptorSetLayout layout = pipeline.set_layout();
    VkDescriptorSetAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    info.descriptorSetCount = 1;
    info.pSetLayouts = &layout;
    for (;; ++current_pool) {
        const bool fresh = current_pool == descriptor_pools.size();
        if (fresh) {
            const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, kBindingsPerPool};
            VkDescriptorPoolCreateInfo pool_info{};
            pool_info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
            pool_info.maxSets = kSetsPerPool;
            pool_info.poolSizeCount = 1;
            pool_info.pPoolSizes = &size;
            VkDescriptorPool handle = VK_NULL_HANDLE;
            check_vulkan(vkCreateDescriptorPool(device.handle(), &pool_info, nullptr, &handle),
                         "descriptor pool");
            descriptor_pools.push_back(handle);
        }
        info.descriptorPool = descriptor_pools[current_pool];
        VkDescriptorSet set = VK_NULL_HANDLE;
        const VkResult result = vkAllocateDescriptorSets(device.handle(), &info, &set);
        if (result == VK_SUCCESS) return set;
        const bool full =
            result == VK_ERROR_OUT_OF_POOL_MEMORY || result == VK_ERROR_FRAGMENTED_POOL;
        if (!full || fresh) check_vulkan(result, here() + ", descriptors");
    }
}

void Commands::State::bind(const Pipeline& pipeline, std::span<const std::byte> args,
                           std::span<const BufferRange> buffers) {
    const std::size_t count = pipeline.bindings().size();
    const std::uint32_t push_bytes = pipeline.push_constant_bytes();
    check_recording(recording);
    DARB_CHECK(buffers.size() == count, "{} binds {} buffers, declares {}", pipeline.name(),
               buffers.size(), count);
    DARB_CHECK(args.size() == push_bytes || (push_bytes == 0 && args.size() == 1),
               "{} is given {} bytes of arguments, declares {}", pipeline.name(), args.size(),
               push_bytes);
    const VkDescriptorSet set = allocate_set(pipeline);
    std::vector<VkDescriptorBufferInfo> infos(count);
    std::vector<VkWriteDescriptorSet> writes(count);
    const std::uint64_t limit = device.info().max_storage_buffer_bytes;
    for (std::uint32_t i = 0; i < count; ++i) {
        const BufferRange& range = buffers[i];
        DARB_CHECK(*range.buffer, "{} binding {} has no buffer", pipeline.name(), i);
        const std::uint64_t bytes = range.buffer->bytes();
        DARB_CHECK(
            range.offset < bytes && range.offset + range.size <= bytes && range.offset % 256 == 0,
            "{}, \"{}\": {} + {} of {}", pipeline.name(), range.buffer->name(), range.offset,
            range.size, bytes);
        infos[i] = {range.buffer->handle(), range.offset,
                    range.size != 0 ? range.size : bytes - range.offset};
        if (infos[i].range > limit)
            throw Error(here(),
                        fmt::format("buffer \"{}\" is bound with {} MiB, {} allows {} MiB",
                                    range.buffer->name(), infos[i].range >> 20, device.info().name,
                                    limit >> 20),
                        "Use smaller images or fewer splats, or choose another device "
                        "(darb devices).");
        writes[i] = {};
        writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[i].dstSet = set;
        writes[i].dstBinding = i;
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        writes[i].pBufferInfo = &infos[i];
    }
    for (std::uint32_t i = 0; i < count; ++i) {  // only once all of them are accepted
        const Pipeline::Binding& access = pipeline.bindings()[i];
        barriers.use({buffers[i].buffer->handle(), kCompute,
                      access.reads ? VK_ACCESS_2_SHADER_STORAGE_READ_BIT : VkAccessFlags2{},
                      access.writes ? VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT : VkAccessFlags2{}});
    }
    now().descriptors += static_cast<std::uint32_t>(count);
    vkUpdateDescriptorSets(device.handle(), static_cast<std::uint32_t>(count), writes.data(), 0,
                           nullptr);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.handle());
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.layout(), 0, 1, &set,
                            0, nullptr);
    if (push_bytes > 0)
        vkCmdPushConstants(commands, pipeline.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, push_bytes,
                           args.data());
}

void Commands::State::place_barriers() {
    const std::optional<VkMemoryBarrier2> needed = barriers.resolve();
    if (!needed) return;
    ++now().barriers;
    record_barrier(commands, *needed);
}

// Once a window's panels were drawn, lavapipe takes a timestamp when it next flushes its commands,
// which may be after a dispatch that needed no barrier: the pass before would get that one's time.
void Commands::State::write_timestamp() {
    timestamps.write(commands);
    if (device.is_lavapipe()) record_barrier(commands, full_barrier());
}

void Commands::State::finish_pass() {
    if (!passes.empty() && device.state().instance.debug().end_label != nullptr)
        device.state().instance.debug().end_label(commands);
    if (timed && !passes.empty()) write_timestamp();
}

std::string Commands::State::all_passes() const {
    if (passes.empty()) return "submission";
    if (passes.size() == 1) return here();
    return fmt::format("passes \"{}\" to \"{}\"", passes.front().name, passes.back().name);
}

Commands::Commands(Device& device) : state_(std::make_unique<State>(device)) {
    state_->create();
}
Commands::~Commands() = default;
Commands::Commands(Commands&&) noexcept = default;
Commands& Commands::operator=(Commands&&) noexcept = default;

void Commands::begin() {
    State& s = *state_;
    if (s.in_flight)
        throw Error("commands", "begin() while they are under way", "Call wait() first.");
    check_vulkan(vkResetCommandPool(s.device.handle(), s.pool, 0), "command pool");
    for (VkDescriptorPool pool : s.descriptor_pools)
        vkResetDescriptorPool(s.device.handle(), pool, 0);
    s.current_pool = 0;
    s.passes.clear();
    s.timestamps.restart();
    s.barriers.clear();
    VkCommandBufferBeginInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check_vulkan(vkBeginCommandBuffer(s.commands, &info), "command buffer");
    s.recording = true;
    record_barrier(s.commands, full_barrier());
}

void Commands::pass(std::string_view name) {
    State& s = *state_;
    check_recording(s.recording);
    if (s.timed && s.passes.empty()) s.write_timestamp();
    s.finish_pass();
    s.passes.push_back({std::string(name)});
    const DebugUtils& debug = s.device.state().instance.debug();
    if (debug.begin_label == nullptr) return;
    VkDebugUtilsLabelEXT label{};
    label.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT;
    label.pLabelName = s.passes.back().name.c_str();
    debug.begin_label(s.commands, &label);
}

void Commands::dispatch_bytes(const Pipeline& pipeline, std::span<const std::byte> args,
                              std::span<const BufferRange> buffers, std::uint32_t groups_x,
                              std::uint32_t groups_y, std::uint32_t groups_z) {
    State& s = *state_;
    const std::uint32_t* limit = s.device.state().limits.maxComputeWorkGroupCount;
    DARB_CHECK(groups_x >= 1 && groups_y >= 1 && groups_z >= 1 && groups_x <= limit[0] &&
                   groups_y <= limit[1] && groups_z <= limit[2],
               "{}: {} x {} x {} groups", pipeline.name(), groups_x, groups_y, groups_z);
    s.bind(pipeline, args, buffers);
    s.place_barriers();
    ++s.now().dispatches;
    vkCmdDispatch(s.commands, groups_x, groups_y, groups_z);
}

void Commands::dispatch_indirect_bytes(const Pipeline& pipeline, std::span<const std::byte> args,
                                       std::span<const BufferRange> buffers, const Buffer& indirect,
                                       std::uint64_t offset) {
    State& s = *state_;
    DARB_CHECK(offset % 4 == 0 && offset + sizeof(VkDispatchIndirectCommand) <= indirect.bytes(),
               "{}: offset {} in {}", pipeline.name(), offset, indirect.bytes());
    s.bind(pipeline, args, buffers);
    s.barriers.use({indirect.handle(), VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT,
                    VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT, 0});
    s.place_barriers();
    ++s.now().dispatches;
    vkCmdDispatchIndirect(s.commands, indirect.handle(), offset);
}

void Commands::fill(const BufferRange& range, std::uint32_t word) {
    State& s = *state_;
    const std::uint64_t bytes = range.buffer->bytes();
    const std::uint64_t size = range.size != 0 ? range.size : (bytes - range.offset) / 4 * 4;
    check_recording(s.recording);
    if (range.offset % 4 != 0 || size % 4 != 0 || !is_within(range.offset, size, bytes))
        throw Error(range.buffer->name(),
                    fmt::format("bytes {} + {} of {} are to be filled", range.offset, size, bytes),
                    "Fill whole words of the buffer.");
    if (size == 0) return;
    s.barriers.use({range.buffer->handle(), kTransfer, 0, VK_ACCESS_2_TRANSFER_WRITE_BIT});
    s.place_barriers();
    vkCmdFillBuffer(s.commands, range.buffer->handle(), range.offset, size, word);
}

void Commands::copy(const BufferRange& from, const BufferRange& to, std::uint64_t bytes) {
    State& s = *state_;
    check_recording(s.recording);
    if (!is_within(from.offset, bytes, from.buffer->bytes()) ||
        !is_within(to.offset, bytes, to.buffer->bytes()))
        throw Error(to.buffer->name(),
                    fmt::format("{} bytes of \"{}\" are to be copied, from {} of {} to {} of {}",
                                bytes, from.buffer->name(), from.offset, from.buffer->bytes(),
                                to.offset, to.buffer->bytes()),
                    "Copy what both buffers hold.");
    if (bytes == 0) return;
    s.barriers.use({from.buffer->handle(), kTransfer, VK_ACCESS_2_TRANSFER_READ_BIT, 0});
    s.barriers.use({to.buffer->handle(), kTransfer, 0, VK_ACCESS_2_TRANSFER_WRITE_BIT});
    s.place_barriers();
    const VkBufferCopy region{from.offset, to.offset, bytes};
    vkCmdCopyBuffer(s.commands, from.buffer->handle(), to.buffer->handle(), 1, &region);
}

// All memory is ordered with it: buffers that it is copied from or to need no barrier of their own.
void Commands::change_layout(DeviceImage& image, VkImageLayout layout) {
    check_recording(state_->recording);
    const VkMemoryBarrier2 memory = full_barrier();
    VkImageMemoryBarrier2 barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2;
    barrier.srcStageMask = memory.srcStageMask;
    barrier.srcAccessMask = memory.srcAccessMask;
    barrier.dstStageMask = memory.dstStageMask;
    barrier.dstAccessMask = memory.dstAccessMask;
    barrier.oldLayout = std::exchange(image.layout_, layout);
    barrier.newLayout = layout;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image.handle();
    barrier.subresourceRange = kWholeColour;
    VkDependencyInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
    info.memoryBarrierCount = 1;
    info.pMemoryBarriers = &memory;
    info.imageMemoryBarrierCount = 1;
    info.pImageMemoryBarriers = &barrier;
    vkCmdPipelineBarrier2(state_->commands, &info);
}

void Commands::overwrite(DeviceImage& image) {
    check_recording(state_->recording);         // before the image forgets its layout
    image.layout_ = VK_IMAGE_LAYOUT_UNDEFINED;  // what it held is not needed
    change_layout(image, kTarget);
}

void Commands::clear(DeviceImage& image, const std::array<float, 4>& colour) {
    overwrite(image);
    const VkClearColorValue value{{colour[0], colour[1], colour[2], colour[3]}};
    vkCmdClearColorImage(state_->commands, image.handle(), kTarget, &value, 1, &kWholeColour);
}

void Commands::copy(const Buffer& from, DeviceImage& to) {
    State& s = *state_;
    check_recording(s.recording);
    check_holds(from, to);
    s.barriers.use({from.handle(), kTransfer, VK_ACCESS_2_TRANSFER_READ_BIT, 0});
    s.place_barriers();
    overwrite(to);
    const VkBufferImageCopy region = whole_image(to);
    vkCmdCopyBufferToImage(s.commands, from.handle(), to.handle(), kTarget, 1, &region);
}

void Commands::copy(DeviceImage& from, const Buffer& to) {
    State& s = *state_;
    check_recording(s.recording);
    check_holds(to, from);
    s.barriers.use({to.handle(), kTransfer, 0, VK_ACCESS_2_TRANSFER_WRITE_BIT});
    s.place_barriers();
    change_layout(from, kSource);
    const VkBufferImageCopy region = whole_image(from);
    vkCmdCopyImageToBuffer(s.commands, from.handle(), kSource, to.handle(), 1, &region);
}

void Commands::copy(DeviceImage& from, DeviceImage& to, VkFilter filter) {
    State& s = *state_;
    change_layout(from, kSource);
    overwrite(to);
    if (from.format() == to.format() && from.same_size(to)) {
        VkImageCopy region{};
        region.srcSubresource = region.dstSubresource = kColourLayer;
        region.extent = extent_of(to);
        vkCmdCopyImage(s.commands, from.handle(), kSource, to.handle(), kTarget, 1, &region);
        return;
    }
    VkImageBlit region{};
    region.srcSubresource = region.dstSubresource = kColourLayer;
    region.srcOffsets[1] = {from.width(), from.height(), 1};
    region.dstOffsets[1] = {to.width(), to.height(), 1};
    vkCmdBlitImage(s.commands, from.handle(), kSource, to.handle(), kTarget, 1, &region, filter);
}

VkCommandBuffer Commands::handle() const {
    check_recording(state_->recording);
    return state_->commands;
}

void Commands::submit(VkSemaphore wait_for, VkSemaphore signal) {
    State& s = *state_;
    check_recording(s.recording);
    s.finish_pass();
    if (const auto to_host = s.barriers.to_host()) record_barrier(s.commands, *to_host);
    s.recording = false;
    check_vulkan(vkEndCommandBuffer(s.commands), s.all_passes());
    check_vulkan(vkResetFences(s.device.handle(), 1, &s.fence), s.all_passes());
    check_vulkan(s.device.state().submit(s.commands, s.fence, wait_for, signal), s.all_passes());
    s.in_flight = !s.device.state().compile_only;
}

void Commands::wait() {
    State& s = *state_;
    if (!s.in_flight) return;
    const VkResult result = vkWaitForFences(s.device.handle(), 1, &s.fence, VK_TRUE, UINT64_MAX);
    s.in_flight = false;
    check_vulkan(result, s.all_passes());
}

bool Commands::done() const {
    const State& s = *state_;
    return !s.in_flight || vkGetFenceStatus(s.device.handle(), s.fence) != VK_NOT_READY;
}

const std::vector<RecordedPass>& Commands::recorded() const {
    return state_->passes;
}

std::vector<PassTime> Commands::pass_times() const {
    const State& s = *state_;
    if (s.in_flight || s.recording)
        throw Error("commands", "times are asked for before the work is done",
                    "Call wait() first.");
    std::vector<PassTime> times;
    if (!s.timed) return times;
    const std::vector<std::uint64_t> ticks = s.timestamps.read();
    const std::uint32_t bits = s.device.state().timestamp_bits;
    for (std::size_t i = 0; i < s.passes.size(); ++i) {
        const auto elapsed = static_cast<double>(tick_difference(ticks[i], ticks[i + 1], bits));
        times.push_back({s.passes[i].name, elapsed * s.device.info().timestamp_period_ns * 1e-6});
    }
    return times;
}

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
