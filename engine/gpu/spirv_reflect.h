// SPDX-License-Identifier: MIT
// What a SPIR-V compute module says about its interface: a reader for the modules that glslang
// writes with names kept (no -s, no stripping). Private to engine/gpu.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

struct ShaderInterface {
    struct Binding {
        std::uint32_t set = 0, binding = 0;
        bool storage_buffer = false;
        bool reads = true, writes = true;  // from readonly and writeonly
        std::string name;
    };
    enum class ScalarType { boolean, signed_int, unsigned_int, floating };
    struct Constant {  // one per SpecId, though glslang emits THREADS twice
        std::uint32_t id = 0;
        ScalarType type = ScalarType::unsigned_int;
        std::uint32_t default_bits = 0;
        std::string name;
    };

    bool uses_subgroups = false;              // asks for the capability GroupNonUniform
    std::vector<std::uint32_t> capabilities;  // capabilities that it asks for, in order
    std::vector<Binding> bindings;            // in order of set, binding
    std::vector<Constant> constants;          // in order of id
    std::uint32_t push_constant_bytes = 0;    // size of the block, as a C++ struct of that layout
    std::array<std::uint32_t, 3> local_size{1, 1, 1};            // defaults
    std::array<std::int64_t, 3> local_size_spec_id{-1, -1, -1};  // -1 = fixed
};

/// Aborts on a module that is no SPIR-V, for modules come from the build only.
ShaderInterface reflect_spirv(std::span<const std::uint32_t> words, std::string_view shader);

}  // namespace darb
