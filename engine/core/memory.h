// How much memory the machine has left, and memory that goes back to it.
#pragma once

#include <cstdint>
#include <filesystem>

namespace darb {

/// Bytes that can be taken before the machine has none: what Linux calls available and its swap, at
/// most what the control groups of this process leave, a container's among them. What a group keeps
/// of files counts as free, as Linux gives it back before a group runs out. The largest number
/// where nothing says. root: whose proc/ and sys/ are read; tests have their own.
std::uint64_t free_memory(const std::filesystem::path& root = "/");

/// After large things were freed: glibc keeps their pages otherwise.
void give_back_freed_memory();

}  // namespace darb
