// SPDX-License-Identifier: MIT
// Sizes of memory as options take them.
#pragma once

#include <optional>
#include <string>

namespace darb {

/// Bytes of "800MB", "1.5 GB", "2GiB" or a plain number; nothing where the text is none of them.
std::optional<double> parse_bytes(const std::string& text);

}  // namespace darb
