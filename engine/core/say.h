// What a program says while it works, on stderr: a closed or full stderr is no reason to stop. What
// it was asked for it tells on stdout: a full disk there counts, a reader that is gone does not.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/core/text.h"

namespace darb {

/// The text as it is, flushed; what cannot be written is lost. Never throws.
void say_text(std::string_view text) noexcept;

/// Formatted, and printable(): names of files may hold what steers a terminal.
template <typename... T>
void say(fmt::format_string<T...> format, T&&... values);

/// A line on stderr that is neither warning nor error: nothing after leave_out_notes(true).
void say_note(std::string_view line);
/// "note: ..." lines, as readers give them.
void say_notes(const std::vector<std::string>& notes);
void leave_out_notes(bool quiet);

/// Writes to stdout and flushes. Where nobody reads any more (a pipe that was closed, a terminal
/// that is gone), stdout becomes /dev/null; false, with errno, where it fails otherwise (a full
/// disk).
bool write_or_let_go(std::string_view text);

/// What the program was asked for, to stdout: formatted, and printable(). Throws std::system_error
/// where write_or_let_go() fails.
template <typename... T>
void tell(fmt::format_string<T...> format, T&&... values);
/// The same to stdout, or said on stderr; nothing where stream is null.
template <typename... T>
void tell(std::FILE* stream, fmt::format_string<T...> format, T&&... values);
void tell_text(std::string_view text);  // as it is

/// Opens /dev/null for those of stdin, stdout and stderr that are closed: else the next file that
/// is opened takes their number, and what is printed goes into it. What is written to stdout fails.
void keep_standard_descriptors();

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
