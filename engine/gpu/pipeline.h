// Pipeline: one compute shader of the table with its specialization constants set by name.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/gpu/device.h"

namespace darb {

/// Name in GLSL -> value. Integers also set bool and uint constants. Names that the shader does not
/// declare are ignored, so that one table can serve all passes; see Pipeline::declares.
using SpecValue = std::variant<std::int32_t, float>;
using SpecConstants = std::map<std::string, SpecValue, std::less<>>;

class Pipeline {
  public:
    Pipeline() = default;
    /// shader: a name of the embedded table. Compiled here, or at first dispatch on lavapipe.
    /// Of a shader that uses subgroups: require_full_subgroups asks the driver for subgroups
    /// without idle lanes; where the workgroup is no multiple of the device's subgroup size, a
    /// smaller size is asked for if there is one. subgroup_size: 0 = the device's own choice; else
    /// one between its minimum and maximum.
    Pipeline(Device& device, std::string_view shader, const SpecConstants& constants = {},
             bool require_full_subgroups = true, std::uint32_t subgroup_size = 0);
    ~Pipeline();
    Pipeline(Pipeline&&) noexcept;
    Pipeline& operator=(Pipeline&&) noexcept;

    const std::string& name() const { return name_; }
    VkPipeline handle() const { return pipeline_; }
    VkPipelineLayout layout() const { return layout_; }
    VkDescriptorSetLayout set_layout() const { return set_layout_; }
    std::uint32_t push_constant_bytes() const { return push_constant_bytes_; }
    explicit operator bool() const { return pipeline_ != VK_NULL_HANDLE; }

    /// What the SPIR-V says of set 0: bindings must be 0..count-1, all storage buffers.
    struct Binding {
        bool reads = true;
        bool writes = true;
    };
    const std::vector<Binding>& bindings() const { return bindings_; }
    /// Whether the shader has a specialization constant of this name.
    bool declares(std::string_view constant) const;
    std::uint32_t threads_x() const { return threads_x_; }  // workgroup size, after specialization

  private:
    Device* device_ = nullptr;
    std::string name_;
    VkPipeline pipeline_ = VK_NULL_HANDLE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
    std::uint32_t push_constant_bytes_ = 0;
    std::uint32_t threads_x_ = 0;
    std::vector<Binding> bindings_;
    std::vector<std::string> constant_names_;

    void release() noexcept;
};

}  // namespace darb
