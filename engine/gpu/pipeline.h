// SPDX-License-Identifier: MIT
// Pipeline: one compute shader of the table with its specialization constants set by name.
#pragma once

#include <darb_constant_names.h>
#include <vulkan/vulkan.h>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <variant>
#include <vector>

#include "engine/gpu/device.h"

namespace darb {

/// The name of a specialization constant that a shader declares. Made of a literal, which is
/// checked while compiling.
class ConstantName {
  public:
    template <std::size_t n>
    consteval ConstantName(const char (&name)[n])
        : text_(declared(std::string_view(name, n - 1))) {}  // implicit, as SpecValue
    constexpr std::string_view text() const { return text_; }
    bool operator==(const ConstantName&) const = default;
    bool operator<(const ConstantName& other) const { return text_ < other.text_; }

  private:
    static consteval std::string_view declared(std::string_view name) {
        for (const std::string_view known : kConstantNames)
            if (known == name) return known;
        throw "no shader declares a specialization constant of this name";
    }
    std::string_view text_;
};

/// The value of a specialization constant. Integers also set bool and uint constants.
struct SpecValue {
    std::variant<std::int32_t, float> value;
    bool shared = false;  // from a table for several passes: for_several_passes

    SpecValue() = default;
    template <class T>
    requires std::constructible_from<std::variant<std::int32_t, float>, T> SpecValue(T of)
        : value(of) {}  // implicit, so that tables are lists of names and values
    bool operator==(const SpecValue&) const = default;
    bool operator<(const SpecValue& other) const {
        return std::tie(value, shared) < std::tie(other.value, other.shared);
    }
};

/// Name in GLSL -> value. A pipeline aborts on a name that its shader does not declare, as that
/// would leave the shader's default in place without a word.
class SpecConstants : public std::map<ConstantName, SpecValue> {
  public:
    struct Entry {
        ConstantName name;
        SpecValue value;
    };
    SpecConstants() = default;
    SpecConstants(std::initializer_list<Entry> entries) {
        for (const Entry& entry : entries) (*this)[entry.name] = entry.value;
    }
};

/// The same values for passes of which each takes those that its shader declares.
SpecConstants for_several_passes(SpecConstants constants);

/// In place of a size: the driver chooses one for each shader, with as many lanes as it has
/// registers for. For shaders that compute the same with any size.
inline constexpr std::uint32_t kAnySubgroupSize = ~0u;

/// All that a pipeline is made of: equal keys are one pipeline of a device. Constants of a table
/// for several passes that the shader does not declare make no difference.
struct PipelineKey {
    std::string shader;
    SpecConstants constants;
    bool require_full_subgroups = true;
    std::uint32_t subgroup_size = 0;
    bool operator==(const PipelineKey&) const = default;
    bool operator<(const PipelineKey& other) const {
        return std::tie(shader, constants, require_full_subgroups, subgroup_size) <
               std::tie(other.shader, other.constants, other.require_full_subgroups,
                        other.subgroup_size);
    }
};

/// A handle: copies share the pipeline, and so do all of a device with the same key. It lives as
/// long as one of them. They may be made on any thread.
class Pipeline {
  public:
    Pipeline() = default;
    /// shader: a name of the embedded table. Compiled here, or at first dispatch on lavapipe.
    /// For a shader that uses subgroups, require_full_subgroups asks the driver for subgroups
    /// without idle lanes; where the workgroup is no multiple of the device's subgroup size, a
    /// smaller size is asked for if there is one. subgroup_size: 0 = the device's own; else one
    /// between its minimum and maximum, or kAnySubgroupSize, whose lanes may be idle.
    Pipeline(Device& device, std::string_view shader, const SpecConstants& constants = {},
             bool require_full_subgroups = true, std::uint32_t subgroup_size = 0);
    Pipeline(Device& device, const PipelineKey& key);

    explicit operator bool() const { return made_ != nullptr; }
    const std::string& name() const { return made_->shader; }
    VkPipeline handle() const { return made_->pipeline; }
    VkPipelineLayout layout() const { return made_->layout; }
    VkDescriptorSetLayout set_layout() const { return made_->set_layout; }
    std::uint32_t push_constant_bytes() const { return made_->push_constant_bytes; }

    /// What the SPIR-V says of set 0: bindings must be 0..count-1, all storage buffers.
    struct Binding {
        bool reads = true;
        bool writes = true;
    };
    const std::vector<Binding>& bindings() const { return made_->bindings; }
    /// Whether the shader has a specialization constant of this name.
    bool declares(std::string_view constant) const;
    std::uint32_t threads_x() const { return made_->threads_x; }  // after specialization

  private:
    struct Made {
        Made(Device& device, const PipelineKey& key);
        ~Made();
        Made(const Made&) = delete;
        Made& operator=(const Made&) = delete;

        VkDevice device = VK_NULL_HANDLE;
        std::string shader;
        VkPipeline pipeline = VK_NULL_HANDLE;
        VkPipelineLayout layout = VK_NULL_HANDLE;
        VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
        std::uint32_t push_constant_bytes = 0;
        std::uint32_t threads_x = 0;
        std::vector<Binding> bindings;
        std::vector<std::string> constant_names;

      private:
        void release() noexcept;
    };
    friend class PipelineTable;
    std::shared_ptr<const Made> made_;
};

/// Keys of the device's pipelines that are alive. From any thread.
std::vector<PipelineKey> live_pipelines(const Device& device);

/// Finds a device's pipelines by their keys. Private to engine/gpu.
class PipelineTable {
  public:
    std::vector<PipelineKey> keys() const;
    /// Keeps those that are made from now on alive, until clear().
    void keep() { keeps_ = true; }
    void clear();

  private:
    friend class Pipeline;
    std::shared_ptr<const Pipeline::Made> find(const PipelineKey& key);
    void add(const PipelineKey& key, const std::shared_ptr<const Pipeline::Made>& made);

    mutable std::mutex mutex_;
    std::map<PipelineKey, std::weak_ptr<const Pipeline::Made>> made_;
    std::vector<std::shared_ptr<const Pipeline::Made>> kept_;
    bool keeps_ = false;
};

}  // namespace darb
