// SPDX-License-Identifier: MIT
#include "engine/gpu/pipeline.h"
#include "engine/gpu/shader_table.h"

#include <fmt/format.h>
#include <algorithm>
#include <bit>
#include <chrono>
#include <utility>

#include "engine/core/error.h"
#include "engine/gpu/device_state.h"
#include "engine/gpu/spirv_reflect.h"

namespace darb {

namespace {

std::span<const std::uint32_t> find_shader(std::string_view name) {
    for (const ShaderBinary& shader : shader_table())
        if (shader.name == name) return shader.words;
    DARB_CHECK(false, "no shader \"{}\" in the table", name);
    return {};
}

// Read once a process.
const ShaderInterface& interface_of(const std::string& shader) {
    static std::mutex mutex;
    static std::map<std::string, ShaderInterface> known;
    const std::lock_guard lock(mutex);
    const auto found = known.find(shader);
    if (found != known.end()) return found->second;
    return known.emplace(shader, reflect_spirv(find_shader(shader), shader)).first->second;
}

bool declares_constant(const ShaderInterface& shader, std::string_view name) {
    return std::any_of(shader.constants.begin(), shader.constants.end(),
                       [&](const auto& constant) { return constant.name == name; });
}

std::string names_of_constants(const ShaderInterface& shader) {
    std::string names;
    for (const auto& constant : shader.constants)
        if (!constant.name.empty()) names += (names.empty() ? "" : ", ") + constant.name;
    return names.empty() ? "none" : names;
}

// The key without constants that are meant for other shaders, so that equal pipelines are one.
PipelineKey declared(PipelineKey key) {
    const ShaderInterface& shader = interface_of(key.shader);
    std::erase_if(key.constants, [&](const auto& given) {
        if (declares_constant(shader, given.first.text())) return false;
        DARB_CHECK(given.second.shared,
                   "shader {} declares no specialization constant {}; it declares {}", key.shader,
                   given.first.text(), names_of_constants(shader));
        return true;
    });
    for (auto& given : key.constants) given.second.shared = false;
    return key;
}

std::uint32_t bits_of(const SpecValue& given, const ShaderInterface::Constant& constant,
                      std::string_view shader) {
    using Type = ShaderInterface::ScalarType;
    const auto& value = given.value;
    const auto* integer = std::get_if<std::int32_t>(&value);
    if (constant.type == Type::floating)
        return std::bit_cast<std::uint32_t>(integer != nullptr ? static_cast<float>(*integer)
                                                               : std::get<float>(value));
    DARB_CHECK(integer != nullptr, "{}: {} is no float", shader, constant.name);
    if (constant.type == Type::boolean) return *integer != 0 ? 1 : 0;
    return static_cast<std::uint32_t>(*integer);
}

const SpecValue* find_given(const SpecConstants& given, std::string_view name) {
    for (const auto& [known, value] : given)
        if (known.text() == name) return &value;
    return nullptr;
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
            const SpecValue* found = find_given(given, constant.name);
            if (found == nullptr) continue;
            entries.push_back({constant.id, static_cast<std::uint32_t>(data.size() * 4), 4});
            data.push_back(bits_of(*found, constant, name));
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
        const SpecValue* found = find_given(given, constant.name);
        if (found == nullptr) continue;
        text += fmt::format("{}{}=", text.empty() ? "" : " ", constant.name);
        std::visit([&](auto value) { text += fmt::format("{}", value); }, found->value);
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
                           const VkSpecializationInfo& specialization,
                           VkPipelineShaderStageCreateFlags flags, std::uint32_t subgroup_size,
                           const std::string& what) {
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
    info.stage.flags = flags;
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

// What a shader needs of a device.
void check_device_limits(const Device::State& state, std::size_t buffers,
                         std::uint32_t push_constant_bytes, std::uint32_t threads_x,
                         const std::string& what) {
    const DeviceInfo& info = state.info;
    const char* remedy = "Choose another device (darb devices).";
    if (buffers > info.max_storage_buffers)
        throw Error(what,
                    fmt::format("needs {} storage buffers, {} allows {}", buffers, info.name,
                                info.max_storage_buffers),
                    remedy);
    if (push_constant_bytes > state.limits.maxPushConstantsSize)
        throw Error(what,
                    fmt::format("needs {} bytes of push constants, {} allows {}",
                                push_constant_bytes, info.name, state.limits.maxPushConstantsSize),
                    remedy);
    if (threads_x > info.max_workgroup_threads)
        throw Error(what,
                    fmt::format("needs workgroups of {} threads, {} allows {}", threads_x,
                                info.name, info.max_workgroup_threads),
                    remedy);
}

}  // namespace

SpecConstants for_several_passes(SpecConstants constants) {
    for (auto& constant : constants) constant.second.shared = true;
    return constants;
}

Pipeline::Made::Made(Device& of, const PipelineKey& key) : shader(key.shader) {
    Device::State& state = of.state();
    device = state.device;
    const std::string what = "shader " + shader;
    const std::span<const std::uint32_t> words = find_shader(shader);
    const ShaderInterface& interface = interface_of(shader);
    for (std::size_t i = 0; i < interface.bindings.size(); ++i) {
        const ShaderInterface::Binding& b = interface.bindings[i];
        DARB_CHECK(b.set == 0 && b.binding == i && b.storage_buffer,
                   "{}: \"{}\" stands at set {} binding {}, expected storage buffer {}", what,
                   b.name, b.set, b.binding, i);
        bindings.push_back({b.reads, b.writes});
    }
    for (const auto& constant : interface.constants) constant_names.push_back(constant.name);
    push_constant_bytes = interface.push_constant_bytes;
    const Specialization specialization(interface, key.constants, shader);
    threads_x = specialization.threads_x;
    check_device_limits(state, bindings.size(), push_constant_bytes, threads_x, what);

    const bool any = key.subgroup_size == kAnySubgroupSize;
    const bool one_size = interface.uses_subgroups && !any;
    bool full = key.require_full_subgroups && one_size;
    const std::uint32_t size =
        one_size ? fitting_subgroup_size(state.info, threads_x, key.subgroup_size, full) : 0;
    VkPipelineShaderStageCreateFlags flags = 0;
    if (full) flags |= VK_PIPELINE_SHADER_STAGE_CREATE_REQUIRE_FULL_SUBGROUPS_BIT;
    if (any && interface.uses_subgroups &&
        state.info.min_subgroup_size != state.info.max_subgroup_size)
        flags |= VK_PIPELINE_SHADER_STAGE_CREATE_ALLOW_VARYING_SUBGROUP_SIZE_BIT;
    const VkSpecializationInfo specialization_info = specialization.info();
    try {
        set_layout = create_set_layout(device, bindings.size(), what);
        layout = create_layout(device, set_layout, push_constant_bytes, what);
        const auto begun = std::chrono::steady_clock::now();
        pipeline = create_pipeline(state, layout, words, specialization_info, flags, size, what);
        const std::chrono::duration<double, std::milli> took =
            std::chrono::steady_clock::now() - begun;
        if (state.compile_only)
            state.note_compiled(pipeline, {shader,
                                           given_constants(interface, key.constants),
                                           threads_x,
                                           size,
                                           took.count(),
                                           {}});
    } catch (...) {
        release();
        throw;
    }
    state.set_name(VK_OBJECT_TYPE_PIPELINE, reinterpret_cast<std::uint64_t>(pipeline), shader);
}

void Pipeline::Made::release() noexcept {
    vkDestroyPipeline(device, pipeline, nullptr);
    vkDestroyPipelineLayout(device, layout, nullptr);
    vkDestroyDescriptorSetLayout(device, set_layout, nullptr);
}

Pipeline::Made::~Made() {
    release();
}

Pipeline::Pipeline(Device& device, std::string_view shader, const SpecConstants& constants,
                   bool require_full_subgroups, std::uint32_t subgroup_size)
    : Pipeline(device, {std::string(shader), constants, require_full_subgroups, subgroup_size}) {}

Pipeline::Pipeline(Device& device, const PipelineKey& given) {
    const PipelineKey key = declared(given);
    PipelineTable& table = device.state().pipelines;
    // A device that only compiles has a row of its table for each.
    if (!device.state().compile_only) made_ = table.find(key);
    if (made_) return;
    made_ = std::make_shared<const Made>(device, key);
    table.add(key, made_);
}

bool Pipeline::declares(std::string_view constant) const {
    const std::vector<std::string>& names = made_->constant_names;
    return std::find(names.begin(), names.end(), constant) != names.end();
}

std::vector<PipelineKey> live_pipelines(const Device& device) {
    return device.state().pipelines.keys();
}

std::vector<PipelineKey> PipelineTable::keys() const {
    const std::lock_guard lock(mutex_);
    std::vector<PipelineKey> keys;
    for (const auto& [key, made] : made_)
        if (!made.expired()) keys.push_back(key);
    return keys;
}

std::shared_ptr<const Pipeline::Made> PipelineTable::find(const PipelineKey& key) {
    const std::lock_guard lock(mutex_);
    const auto found = made_.find(key);
    return found == made_.end() ? nullptr : found->second.lock();
}

// Where two threads made the same one, the later is the one that others find.
void PipelineTable::add(const PipelineKey& key, const std::shared_ptr<const Pipeline::Made>& made) {
    const std::lock_guard lock(mutex_);
    std::erase_if(made_, [](const auto& entry) { return entry.second.expired(); });
    made_[key] = made;
    if (keeps_) kept_.push_back(made);
}

void PipelineTable::clear() {
    const std::lock_guard lock(mutex_);
    kept_.clear();
}

}  // namespace darb
