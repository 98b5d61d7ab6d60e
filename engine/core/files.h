// SPDX-License-Identifier: MIT
// Files: reading them whole, and writing them so that either the old file or the new one remains,
// never half of one.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

/// Whether the name ends in `extension` (lower case, with its dot), ignoring case.
bool has_extension(const std::filesystem::path& path, std::string_view extension);

/// Reads the whole file, or its first `most` bytes. Throws Error naming the file where it cannot be
/// read, is larger than the free memory, or is not a regular file (a folder, a pipe, a device):
/// reading those may never end.
std::vector<std::byte> read_file(const std::filesystem::path& path);
std::vector<std::byte> read_file_head(const std::filesystem::path& path, std::size_t most);
std::string read_text_file(const std::filesystem::path& path);

/// Throws as read_file does where the path exists but is not a regular file. For code that opens
/// files itself.
void check_is_file(const std::filesystem::path& path);

/// Writes to PATH.tmp (PATH.1.tmp and so on where that exists), syncs it, and renames it over PATH.
/// Where PATH is a link, the file that it points to is replaced and keeps its permissions; a pipe
/// or a device is written to directly. Missing folders are made. Throws Error naming the file and
/// the system's reason (disk full, read-only); PATH is then unchanged.
void write_file_atomic(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file_atomic(const std::filesystem::path& path, std::string_view text);

/// Throws Error where the system keeps a part of the name for a device, as Windows does con and
/// aux. write_file_atomic calls it; this is for folders.
void check_file_name(const std::filesystem::path& path);

using FileParts = std::span<const std::span<const std::byte>>;

/// Writes the parts one after the other, without first copying them into one buffer. Otherwise as
/// above.
void write_file_atomic(const std::filesystem::path& path, FileParts parts);

}  // namespace darb
