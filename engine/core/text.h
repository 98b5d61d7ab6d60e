// SPDX-License-Identifier: MIT
// Text in files, on the command line and on terminals: treated as ASCII whatever the locale.
#pragma once

#include <string>
#include <string_view>

namespace darb {

/// The text with ASCII capitals in lower case.
inline std::string lower(std::string_view text) {
    std::string lowered(text);
    for (char& c : lowered)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return lowered;
}

/// Makes text that contains names from files safe for a terminal: control characters, marks of
/// writing direction and bytes that are not UTF-8 become \x1b, \u202e and so on. Everything else
/// stays; so do line breaks where `lines` is true.
std::string printable(std::string_view text, bool lines = false);

/// A quoted Python literal of the name, as ascii(os.fsdecode(name)) gives it. It evaluates to the
/// name and nothing else, whatever its bytes are.
std::string python_string(std::string_view bytes);

}  // namespace darb
