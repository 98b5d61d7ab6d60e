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

/// The whole file, or its first `most` bytes. Throws Error naming the file where it cannot be read,
/// is larger than the free memory, or is no file (a folder, a pipe, a device): those may never end,
/// or wait for ever.
std::vector<std::byte> read_file(const std::filesystem::path& path);
std::vector<std::byte> read_file_head(const std::filesystem::path& path, std::size_t most);
std::string read_text_file(const std::filesystem::path& path);

/// Throws what read_file throws where the path is there and no file. For readers of their own.
void check_is_file(const std::filesystem::path& path);

/// Writes to PATH.tmp, or PATH.1.tmp and so on where that exists, syncs, renames over PATH, or over
/// the file that PATH links to, whose permissions stay; a pipe or a device is written to. Makes
/// missing folders. Throws Error naming the file and the system's reason (disk full, read-only);
/// PATH is then as it was.
void write_file_atomic(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file_atomic(const std::filesystem::path& path, std::string_view text);

// A file that is written from where its parts lie, without one copy of all of them.

using FileParts = std::span<const std::span<const std::byte>>;

/// As write_file_atomic of the parts in a row.
void write_file_atomic(const std::filesystem::path& path, FileParts parts);

}  // namespace darb
