// Text in files and on the command line: ASCII whatever the locale.
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

}  // namespace darb
