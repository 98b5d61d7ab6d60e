// Files: whole reads, and writes that leave the old file or the new one, never half of one.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

/// Whether the name ends in `extension` (lower case, with its dot), in capitals or not.
bool has_extension(const std::filesystem::path& path, std::string_view extension);

/// The whole file. Throws Error naming the file when it cannot be read.
std::vector<std::byte> read_file(const std::filesystem::path& path);
std::string read_text_file(const std::filesystem::path& path);

/// Writes to PATH.tmp, or PATH.1.tmp and so on where that exists, syncs, renames over PATH, or over
/// the file that PATH links to, whose permissions stay; a pipe or a device is written to. Makes
/// missing folders. Throws Error naming the file and the system's reason (disk full, read-only);
/// PATH is then as it was.
void write_file_atomic(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file_atomic(const std::filesystem::path& path, std::string_view text);

}  // namespace darb
