// Contracts: DARB_CHECK aborts on a bug and prints the expression with the values involved.
// Bad input is no bug: that throws Error (engine/core/error.h).
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

namespace darb {

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
