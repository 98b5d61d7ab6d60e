// How much memory the machine has left, and memory that goes back to it.
#pragma once

#include <cstdint>

namespace darb {

/// Bytes that can be taken before the machine has none: what Linux calls available and its swap, at
/// most what the control group leaves. The largest number where neither says.
std::uint64_t free_memory();

/// After large things were freed: glibc keeps their pages otherwise.
void give_back_freed_memory();

}  // namespace darb
