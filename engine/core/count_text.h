// SPDX-License-Identifier: MIT
// Numbers as people read them: with commas between the thousands.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace darb {

/// The text of a number in decimals, such as -1234567.25, with commas: -1,234,567.25.
inline std::string with_thousands(const std::string& plain) {
    const std::size_t first = plain.starts_with('-') ? 1 : 0;
    const std::size_t point = plain.find('.') == std::string::npos ? plain.size() : plain.find('.');
    std::string text;
    for (std::size_t i = 0; i < plain.size(); ++i) {
        if (i > first && i < point && (point - i) % 3 == 0) text += ',';
        text += plain[i];
    }
    return text;
}

/// A count of splats, faces, photos, as window and commands write it: 6,612.
inline std::string count_text(std::uint64_t count) {
    return with_thousands(std::to_string(count));
}

/// A count with its noun: "1 photo", "3 photos".
inline std::string counted(std::uint64_t count, const char* noun) {
    return count_text(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace darb
