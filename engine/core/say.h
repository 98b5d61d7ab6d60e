// SPDX-License-Identifier: MIT
// Printing. Progress goes to stderr with say(), where a closed or full stderr is no reason to stop.
// Results that the user asked for go to stdout with tell(), where a full disk is an error but a
// reader that has gone away is not.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/core/text.h"

namespace darb {

/// Prints the text unchanged and flushes; what cannot be written is lost. Never throws.
void say_text(std::string_view text) noexcept;

/// Formats the text and makes it printable(), because file names may contain control characters.
template <typename... T>
void say(fmt::format_string<T...> format, T&&... values);

/// A line on stderr that is neither warning nor error: nothing after leave_out_notes(true).
void say_note(std::string_view line);
/// "note: ..." lines, as readers give them.
void say_notes(const std::vector<std::string>& notes);
void leave_out_notes(bool quiet);

/// Writes to stdout and flushes. Where the reader has gone away (a closed pipe or terminal), stdout
/// becomes /dev/null. Returns false, with errno set, where writing fails for another reason (a full
/// disk).
bool write_or_let_go(std::string_view text);

/// Prints a result to stdout, formatted and made printable(). Throws std::system_error where
/// write_or_let_go() fails.
template <typename... T>
void tell(fmt::format_string<T...> format, T&&... values);
/// As above for stdout; as say() for stderr; prints nothing where stream is null.
template <typename... T>
void tell(std::FILE* stream, fmt::format_string<T...> format, T&&... values);
void tell_text(std::string_view text);  // unchanged

template <typename... T>
void say(fmt::format_string<T...> format, T&&... values) {
    say_text(printable(fmt::format(format, std::forward<T>(values)...), true));
}

template <typename... T>
void tell(fmt::format_string<T...> format, T&&... values) {
    tell_text(printable(fmt::format(format, std::forward<T>(values)...), true));
}

template <typename... T>
void tell(std::FILE* stream, fmt::format_string<T...> format, T&&... values) {
    if (stream == nullptr) return;
    const std::string text = printable(fmt::format(format, std::forward<T>(values)...), true);
    stream == stderr ? say_text(text) : tell_text(text);
}

}  // namespace darb
