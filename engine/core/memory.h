// SPDX-License-Identifier: MIT
// How much memory the machine has left, and how to hand freed memory back to it.
#pragma once

#include <cstdint>
#include <filesystem>

namespace darb {

/// Bytes that can still be allocated: the available memory and swap that Linux reports, limited by
/// what this process's control groups (those of a container included) have left. A group's file
/// cache counts as free, because Linux drops it before the group runs out. Returns the largest
/// number where nothing is reported. root: the folder whose proc/ and sys/ are read; tests pass
/// their own.
std::uint64_t free_memory(const std::filesystem::path& root = "/");

/// Returns freed pages to the system, which glibc would keep. Call it after freeing large blocks.
void give_back_freed_memory();

}  // namespace darb
