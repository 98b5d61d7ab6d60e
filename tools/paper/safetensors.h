// Safetensors files: named arrays of float32. Format: 8 bytes little-endian length, a JSON header
// {"name": {"dtype", "shape", "data_offsets"}}, then the bytes that the offsets count from.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace darb {

struct Tensor {
    std::vector<std::size_t> shape;
    std::vector<float> data;  // row-major, the last index fastest
};

using Tensors = std::map<std::string, Tensor>;

/// Throws Error naming the file and the tensor: no safetensors file, truncated, sizes that do not
/// fit, or a type other than F32, F16, BF16 and F64 (which become float32; integers are left out).
Tensors read_safetensors(const std::filesystem::path& path);
Tensors parse_safetensors(std::span<const std::byte> file, const std::string& where);

}  // namespace darb
