// NumPy's .npy files, version 1.0: an array of float32 or float64, little-endian, C order.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

namespace darb::check {

/// values.size() is the product of shape. Throws Error as write_file_atomic does.
void write_npy(const std::filesystem::path& path, const std::vector<size_t>& shape,
               std::span<const float> values);
void write_npy(const std::filesystem::path& path, const std::vector<size_t>& shape,
               std::span<const double> values);

}  // namespace darb::check
