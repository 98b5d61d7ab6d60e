#include "engine/gpu/pipeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <utility>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/gpu/device_state.h"
#include "engine/gpu/shader_table.h"
#include "engine/gpu/spirv_reflect.h"

namespace darb {

namespace {

std::span<const std::uint32_t> find_shader(std::string_view name) {
    for (const ShaderBinary& shader : shader_table())
        if (shader.name == name) return shader.words;
    DARB_CHECK(false, "no shader \"{}\" in the table", name);
    return {};
}

std::uint32_t bits_of(const SpecValue& value, const ShaderInterface::Constant& constant,
                      std::string_view shader) {
    using Type = ShaderInterface::ScalarType;
    const auto* integer = std::get_if<std::int32_t>(&value);
    if (constant.type == Type::floating)
        return std::bit_cast<std::uint32_t>(integer != nullptr ? static_cast<float>(*integer)
                                                               : std::get<float>(value));
    DARB_CHECK(integer != nullptr, "{}: {} is no float", shader, constant.name);
    if (constant.type == Type::boolean) return *integer != 0 ? 1 : 0;
    return static_cast<std::uint32_t>(*integer);
}

// Constants given by name, as Vulkan wants them by id. Keeps the memory that info points to.
struct Specialization {
    std::vector<std::uint32_t> data;
    std::vector<VkSpecializationMapEntry> entries;
    std::uint32_t threads_x = 1;

    Specialization(const ShaderInterface& shader, const SpecConstants& given,
                   std::string_view name) {
        threads_x = shader.local_size[0];
        for (const ShaderInterface::Constant& constant : shader.constants) {
            const auto found = given.find(constant.name);
            if (found == given.end()) continue;
            entries.push_back({constant.id, static_cast<std::uint32_t>(data.size() * 4), 4});
            data.push_back(bits_of(found->second, constant, name));
            if (shader.local_size_spec_id[0] == constant.id) threads_x = data.back();
        }
    }
    VkSpecializationInfo info() const {
        return {static_cast<std::uint32_t>(entries.size()), entries.data(), data.size() * 4,
                data.data()};
    }
};

// The subgroup size to require of a shader with subgroup operations, 0 where the device has only
// one: in SPIR-V 1.5 a pipeline that requires none has the device's own size. One is always
// required where there is a choice; other shaders leave it to the driver. Full subgroups need a
// workgroup that is a multiple of it: a smaller size is taken, or full is cleared.
std::uint32_t fitting_subgroup_size(const DeviceInfo& info, std::uint32_t threads,
                                    std::uint32_t asked, bool& full) {
    if (asked == 0 && full && threads % info.subgroup_size != 0)
        for (std::uint32_t size = info.max_subgroup_size; size >= info.min_subgroup_size; size /= 2)
            if (asked == 0 && threads % size == 0) asked = size;
    const std::uint32_t size = asked != 0 ? asked : info.subgroup_size;
    full = full && threads % size == 0;
    return info.min_subgroup_size == info.max_subgroup_size ? 0 : size;
}

// "SH_DEGREE=3 THREADS=64", of what the shader declares.
std::string given_constants(const ShaderInterface& shader, const SpecConstants& given) {
    std::string text;
    for (const ShaderInterface::Constant& constant : shader.constants) {
        const auto found = given.find(constant.name);
        if (found == given.end()) continue;
        text += fmt::format("{}{}=", text.empty() ? "" : " ", constant.name);
        std::visit([&](auto value) { text += fmt::format("{}", value); }, found->second);
    }
    return text;
}

VkDescriptorSetLayout create_set_layout(VkDevice device, std::size_t count,
                                        const std::string& what) {
    std::vector<VkDescriptorSetLayoutBinding> bindings(count);
    for (std::uint32_t i = 0; i < count; ++i)
        bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT,
                       nullptr};
    VkDescriptorSetLayoutCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
    info.bindingCount = static_cast<std::uint32_t>(count);
    info.pBindings = bindings.data();
    VkDescriptorSetLayout layout = VK_NULL_HANDLE;
    check_vulkan(vkCreateDescriptorSetLayout(device, &info, nullptr, &layout), what);
    return layout;
}

VkPipelineLayout create_layout(VkDevice device, const VkDescriptorSetLayout& set_layout,
                               std::uint32_t push_bytes, const std::string& what) {
    const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, push_bytes};
    VkPipelineLayoutCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
    info.setLayoutCount = 1;
    info.pSetLayouts = &set_layout;
    info.pushConstantRangeCount = push_bytes > 0 ? 1 : 0;
    info.pPushConstantRanges = &range;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    check_vulkan(vkCreatePipelineLayout(device, &info, nullptr, &layout), what);
    return layout;
}

VkPipeline create_pipeline(const Device::State& state, VkPipelineLayout layout,
                           std::span<const std::uint32_t> words,
                           const VkSpecializationInfo& specialization, bool full,
                           std::uint32_t subgroup_size, const std::string& what) {
    VkShaderModuleCreateInfo module_info{};
    module_info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
    module_info.codeSize = words.size_bytes();
    module_info.pCode = words.data();
    VkShaderModule module = VK_NULL_HANDLE;
    check_vulkan(vkCreateShaderModule(state.device, &module_info, nullptr, &module), what);

    VkPipelineShaderStageRequiredSubgroupSizeCreateInfo size_info{};
    size_info.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_REQUIRED_SUBGROUP_SIZE_CREATE_INFO;
    size_info.requiredSubgroupSize = subgroup_size;
    VkComputePipelineCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
    info.layout = layout;
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.pNext = subgroup_size != 0 ? &size_info : nullptr;
    info.stage.flags = full ? VK_PIPELINE_SHADER_STAGE_CREATE_REQUIRE_FULL_SUBGROUPS_BIT : 0;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.module = module;
    info.stage.pName = "main";
    info.stage.pSpecializationInfo = &specialization;
    if (state.executable.statistics != nullptr)
        info.flags = VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR;
    VkPipeline pipeline = VK_NULL_HANDLE;
    const VkPipelineCache cache = state.compile_only ? VK_NULL_HANDLE : state.cache;
    const VkResult result =
        vkCreateComputePipelines(state.device, cache, 1, &info, nullptr, &pipeline);
    vkDestroyShaderModule(state.device, module, nullptr);
    check_vulkan(result, what);
    return pipeline;
}

void check_device_limits(const Device::State& state, const Pipeline& pipeline,
                         const std::string& what) {
    const DeviceInfo& info = state.info;
    if (pipeline.bindings().size() > info.max_storage_buffers)
        throw Error(what,
                    fmt::format("needs {} storage buffers, {} allows {}",
                                pipeline.bindings().size(), info.name, info.max_storage_buffers),
                    "Choose another device (darb devices).");
    if (pipeline.push_constant_bytes() > state.limits.maxPushConstantsSize)
        throw Error(what,
                    fmt::format("needs {} bytes of push constants, {} allows {}",
                                pipeline.push_constant_bytes(), info.name,
                                state.limits.maxPushConstantsSize),
                    "Choose another device (darb devices).");
    if (pipeline.threads_x() > info.max_workgroup_threads)
        throw Error(what,
                    fmt::format("needs workgroups of {} threads, {} allows {}",
                                pipeline.threads_x(), info.name, info.max_workgroup_threads),
                    "Choose another device (darb devices).");
}

}  // namespace

Pipeline::Pipeline(Device& device, std::string_view shader, const SpecConstants& constants,
                   bool require_full_subgroups, std::uint32_t subgroup_size)
    : device_(&device), name_(shader) {
    Device::State& state = device.state();
    const std::string what = "shader " + name_;
    const std::span<const std::uint32_t> words = find_shader(shader);
    const ShaderInterface interface = reflect_spirv(words, shader);
    for (std::size_t i = 0; i < interface.bindings.size(); ++i) {
        const ShaderInterface::Binding& b = interface.bindings[i];
        DARB_CHECK(b.set == 0 && b.binding == i && b.storage_buffer,
                   "{}: \"{}\" stands at set {} binding {}, expected storage buffer {}", what,
                   b.name, b.set, b.binding, i);
        bindings_.push_back({b.reads, b.writes});
    }
    for (const auto& constant : interface.constants) constant_names_.push_back(constant.name);
    push_constant_bytes_ = interface.push_constant_bytes;
    const Specialization specialization(interface, constants, shader);
    threads_x_ = specialization.threads_x;
    check_device_limits(state, *this, what);

    bool full = require_full_subgroups && interface.uses_subgroups;
    const std::uint32_t size =
        interface.uses_subgroups
            ? fitting_subgroup_size(state.info, threads_x_, subgroup_size, full)
            : 0;
    const VkSpecializationInfo specialization_info = specialization.info();
    try {
        set_layout_ = create_set_layout(state.device, bindings_.size(), what);
        layout_ = create_layout(state.device, set_layout_, push_constant_bytes_, what);
        const auto begun = std::chrono::steady_clock::now();
        pipeline_ = create_pipeline(state, layout_, words, specialization_info, full, size, what);
        const std::chrono::duration<double, std::milli> took =
            std::chrono::steady_clock::now() - begun;
        if (state.compile_only)
            state.note_compiled(
                pipeline_,
                {name_, given_constants(interface, constants), threads_x_, size, took.count(), {}});
    } catch (...) {
        release();
        throw;
    }
    state.set_name(VK_OBJECT_TYPE_PIPELINE, reinterpret_cast<std::uint64_t>(pipeline_), name_);
}

void Pipeline::release() noexcept {
    if (device_ == nullptr) return;
    vkDestroyPipeline(device_->handle(), pipeline_, nullptr);
    vkDestroyPipelineLayout(device_->handle(), layout_, nullptr);
    vkDestroyDescriptorSetLayout(device_->handle(), set_layout_, nullptr);
    pipeline_ = VK_NULL_HANDLE;
    device_ = nullptr;
}

Pipeline::~Pipeline() {
    release();
}

Pipeline::Pipeline(Pipeline&& other) noexcept {
    *this = std::move(other);
}

Pipeline& Pipeline::operator=(Pipeline&& other) noexcept {
    if (this == &other) return *this;
    release();
    device_ = std::exchange(other.device_, nullptr);
    name_ = std::move(other.name_);
    pipeline_ = std::exchange(other.pipeline_, VK_NULL_HANDLE);
    layout_ = std::exchange(other.layout_, VK_NULL_HANDLE);
    set_layout_ = std::exchange(other.set_layout_, VK_NULL_HANDLE);
    push_constant_bytes_ = other.push_constant_bytes_;
    threads_x_ = other.threads_x_;
    bindings_ = std::move(other.bindings_);
    constant_names_ = std::move(other.constant_names_);
    return *this;
}

bool Pipeline::declares(std::string_view constant) const {
    return std::find(constant_names_.begin(), constant_names_.end(), constant) !=
           constant_names_.end();
}

}  // namespace darb
