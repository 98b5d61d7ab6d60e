// A file that is written from where its parts lie, without one copy of all of them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace darb {

using FileParts = std::span<const std::span<const std::byte>>;

/// As write_file_atomic of the parts in a row.
void write_file_atomic(const std::filesystem::path& path, FileParts parts);

}  // namespace darb
