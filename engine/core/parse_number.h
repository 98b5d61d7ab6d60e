// SPDX-License-Identifier: MIT
// Numbers in text, whatever the locale. std::from_chars reads whole numbers everywhere, but double
// is missing in libc++ before 20, which is macOS's.
#pragma once

#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace darb {

/// std::from_chars for double by std::strtod: the same numbers, ends and errors.
std::from_chars_result double_by_strtod(const char* first, const char* last, double& value);

/// std::from_chars of this type.
template <class T>
std::from_chars_result parse_number(const char* first, const char* last, T& value) {
#ifndef __cpp_lib_to_chars
    if constexpr (std::is_floating_point_v<T>) {
        double wide = 0;
        const std::from_chars_result result = double_by_strtod(first, last, wide);
        if (result.ec == std::errc()) value = static_cast<T>(wide);
        return result;
    } else
#endif
        return std::from_chars(first, last, value);
}

/// The finite numbers of a text, with commas between them and without spaces; nothing where the
/// text is something else.
std::optional<std::vector<double>> number_list(std::string_view text);
/// `count` such numbers. Throws Error naming the option.
std::vector<double> numbers_from(const std::string& option, const std::string& text,
                                 std::size_t count);

}  // namespace darb
