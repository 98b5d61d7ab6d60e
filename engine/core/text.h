// Text in files, on the command line and on terminals: ASCII whatever the locale.
#pragma once

#include <string>
#include <string_view>

namespace darb {

/// With small letters for capitals.
inline std::string lower(std::string_view text) {
    std::string lowered(text);
    for (char& c : lowered)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return lowered;
}

/// Text with names from files, for a terminal: what would steer it (control characters, marks of
/// direction, bytes that are no UTF-8) becomes \x1b, \u202e and so on. All else stays; line breaks
/// stay where lines is true.
std::string printable(std::string_view text, bool lines = false);

/// As Python's ascii() of the name that os.fsdecode gives: a literal in quotes that evaluates to it
/// and to nothing else, whatever its bytes are.
std::string python_string(std::string_view bytes);

}  // namespace darb
