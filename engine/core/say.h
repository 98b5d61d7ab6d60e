// What a program tells people while it works, on stderr: a closed or full stderr is no reason to
// stop. What it was asked for goes to stdout, whose failures count.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <string_view>
#include <utility>

#include "engine/core/text.h"

namespace darb {

/// The text as it is, flushed; what cannot be written is lost. Never throws.
void say_text(std::string_view text) noexcept;

/// Formatted, and printable(): names of files may hold what steers a terminal.
template <typename... T>
void say(fmt::format_string<T...> format, T&&... values);

/// Writes to stdout and flushes. Where nobody reads any more (a pipe that was closed, a terminal
/// that is gone), stdout becomes /dev/null; false, with errno, where it fails otherwise (a full
/// disk).
bool write_or_let_go(std::string_view text);

/// Opens /dev/null for those of stdin, stdout and stderr that are closed: else the next file that
/// is opened takes their number, and what is printed goes into it. What is written to stdout fails.
void keep_standard_descriptors();

template <typename... T>
void say(fmt::format_string<T...> format, T&&... values) {
    say_text(printable(fmt::format(format, std::forward<T>(values)...), true));
}

}  // namespace darb
