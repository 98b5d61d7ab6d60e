// How much memory the machine has left.
#pragma once

#include <cstdint>

namespace darb {

/// Bytes that can be taken before the machine has none: what Linux calls available and its swap, at
/// most what the control group leaves. The largest number where neither says.
std::uint64_t free_memory();

}  // namespace darb
