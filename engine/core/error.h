// SPDX-License-Identifier: MIT
// Error: bad input, or a device that cannot go on. It may be thrown anywhere and is caught once, in
// main, which prints "error: WHERE: WHAT" and "  WHAT TO DO" and exits with status 2. Code that has
// a fallback catches one of the narrower kinds below instead. Also here: DARB_CHECK, for bugs, and
// while_doing(), which turns the system's refusals into an Error.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

namespace darb {

struct Error : std::runtime_error {
    /// where: file and record, or device and pass. what: the reason. hint: what the user can do
    /// about it.
    Error(std::string where_, std::string what_, std::string hint_ = {})
        : std::runtime_error(where_ + ": " + what_ + (hint_.empty() ? "" : "\n  " + hint_)),
          where(std::move(where_)),
          reason(std::move(what_)),
          hint(std::move(hint_)) {}

    std::string where;
    std::string reason;
    std::string hint;
};

/// Memory ran out on the device or the host, or a memory budget or a driver's limit was exceeded. A
/// smaller attempt may succeed, so this is the kind that code with a fallback catches.
struct NoRoom : Error {
    using Error::Error;
};

/// The device is lost, and nothing that uses it can succeed: no fallback may catch this.
struct DeviceLost : Error {
    using Error::Error;
};

/// Hint for errors about bytes that no writer of the format can have meant.
inline constexpr const char* kCopyAgain =
    "The file is damaged or cut off: export or copy it again.";

// Contracts: DARB_CHECK aborts on a bug and prints the expression with the values involved. Bad
// input is not a bug: it throws Error instead.

[[noreturn]] inline void check_failed(const char* file, int line, const char* expression,
                                      const std::string& values) {
    std::fprintf(stderr, "%s:%d: check failed: %s%s%s\n", file, line, expression,
                 values.empty() ? "" : ": ", values.c_str());
    std::abort();
}

inline std::string check_values() {
    return {};
}
template <class... Values>
std::string check_values(fmt::format_string<Values...> format, Values&&... values) {
    return fmt::format(format, std::forward<Values>(values)...);
}

}  // namespace darb

/// DARB_CHECK(i < n, "i = {}, n = {}", i, n): the format and its values are optional.
#define DARB_CHECK(expression, ...)                                  \
    do {                                                             \
        if (!(expression)) [[unlikely]]                              \
            ::darb::check_failed(__FILE__, __LINE__, #expression,    \
                                 ::darb::check_values(__VA_ARGS__)); \
    } while (false)

// What the program was doing when the system refused it memory or a thread.

namespace darb {

/// Returns work(). Throws NoRoom where work() runs out of memory, and Error where it cannot start a
/// thread; either names `what`, which is a file or a part of the work. Other exceptions pass
/// through.
template <class Work>
decltype(auto) while_doing(const std::string& what, Work&& work) {
    constexpr const char* kLess =
        "Close other programs, or give it less: fewer or smaller photos "
        "(-r), fewer splats.";
    try {
        return work();
    } catch (const std::bad_alloc&) {
        throw NoRoom(what, "no memory is left", kLess);
    } catch (const std::length_error&) {  // more than a container can ever hold
        throw NoRoom(what, "more memory is needed than any machine has", kLess);
    } catch (const std::system_error& e) {
        if (e.code() != std::errc::resource_unavailable_try_again) throw;
        throw Error(what, "no thread can be started: " + e.code().message(),
                    "The limits of this system are reached: close other programs.");
    }
}

}  // namespace darb
