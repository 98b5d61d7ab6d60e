// SPDX-License-Identifier: MIT
#include "engine/core/text.h"

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <iterator>

namespace darb {

namespace {

constexpr std::uint32_t kNoCharacter = 0xffffffff;

struct Character {
    std::uint32_t code = kNoCharacter;  // Unicode code point; kNoCharacter for a byte that is not
                                        // UTF-8
    std::size_t bytes = 1;
};

/// The first character of UTF-8 text that is not empty; RFC 3629.
Character first_character(std::string_view text) {
    const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
    const std::uint8_t lead = byte(0);
    if (lead < 0x80) return {lead, 1};
    const std::size_t count = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
    if (lead < 0xc2 || lead > 0xf4 || text.size() < count) return {};
    std::uint32_t code = lead & (0x7fu >> count);
    for (std::size_t i = 1; i < count; ++i) {
        if ((byte(i) & 0xc0) != 0x80) return {};
        code = code << 6 | (byte(i) & 0x3fu);
    }
    const std::uint32_t least = count == 2 ? 0x80 : count == 3 ? 0x800 : 0x10000;
    if (code < least || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return {};
    return {code, count};
}

bool steers_terminal(std::uint32_t code) {
    return code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x61c || code == 0x200e ||
           code == 0x200f || (code >= 0x2028 && code <= 0x202e) ||
           (code >= 0x2066 && code <= 0x2069) || code == 0xfeff;
}

void append_escape(std::uint32_t code, std::string& to) {
    const auto out = std::back_inserter(to);
    if (code < 0x100)
        fmt::format_to(out, "\\x{:02x}", code);
    else if (code < 0x10000)
        fmt::format_to(out, "\\u{:04x}", code);
    else
        fmt::format_to(out, "\\U{:08x}", code);
}

}  // namespace

std::string printable(std::string_view text, bool lines) {
    std::string shown;
    while (!text.empty()) {
        const Character c = first_character(text);
        if (c.code == kNoCharacter)
            append_escape(static_cast<std::uint8_t>(text[0]), shown);
        else if (steers_terminal(c.code) && !(lines && c.code == '\n'))
            append_escape(c.code, shown);
        else
            shown += text.substr(0, c.bytes);
        text.remove_prefix(c.bytes);
    }
    return shown;
}

std::string python_string(std::string_view bytes) {
    const bool twofold =
        bytes.find('\'') != std::string_view::npos && bytes.find('"') == std::string_view::npos;
    const char quote = twofold ? '"' : '\'';
    std::string literal(1, quote);
    while (!bytes.empty()) {
        const Character c = first_character(bytes);
        if (c.code == kNoCharacter)  // in the way os.fsdecode marks it
            append_escape(0xdc00u + static_cast<std::uint8_t>(bytes[0]), literal);
        else if (c.code == '\\' || c.code == static_cast<std::uint32_t>(quote))
            (literal += '\\') += static_cast<char>(c.code);
        else if (c.code == '\n' || c.code == '\r' || c.code == '\t')
            literal += c.code == '\n' ? "\\n" : c.code == '\r' ? "\\r" : "\\t";
        else if (c.code < 0x20 || c.code >= 0x7f)
            append_escape(c.code, literal);
        else
            literal += static_cast<char>(c.code);
        bytes.remove_prefix(c.bytes);
    }
    return literal + quote;
}

}  // namespace darb
