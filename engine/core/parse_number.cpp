// SPDX-License-Identifier: MIT
#include "engine/core/parse_number.h"

#include <algorithm>
#include <cctype>
#include <clocale>
#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "engine/core/error.h"

namespace darb {

namespace {

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

const char* behind_digits(const char* at, const char* last) {
    return std::find_if_not(at, last, is_digit);
}

// The end of a number such as 1.5e-3, or `first` where there is none.
const char* end_of_decimal(const char* first, const char* last) {
    const char* at = behind_digits(first, last);
    std::ptrdiff_t digits = at - first;
    if (at != last && *at == '.') {
        const char* const end = behind_digits(at + 1, last);
        digits += end - at - 1;
        at = end;
    }
    if (digits == 0) return first;
    if (at != last && (*at == 'e' || *at == 'E')) {
        const char* exponent = at + 1;
        if (exponent != last && (*exponent == '-' || *exponent == '+')) ++exponent;
        if (const char* const end = behind_digits(exponent, last); end != exponent) at = end;
    }
    return at;
}

// The end of one of these words in any letters, or `first`.
const char* end_of_word(const char* first, const char* last) {
    for (const std::string_view word : {"infinity", "inf", "nan"}) {
        if (last - first < static_cast<std::ptrdiff_t>(word.size())) continue;
        if (std::equal(word.begin(), word.end(), first, [](char wanted, char c) {
                return std::tolower(static_cast<unsigned char>(c)) == wanted;
            }))
            return first + word.size();
    }
    return first;
}

}  // namespace

std::from_chars_result double_by_strtod(const char* first, const char* last, double& value) {
    const char* const begin = first != last && *first == '-' ? first + 1 : first;
    const char* end = end_of_decimal(begin, last);
    const bool is_word = end == begin;
    if (is_word) end = end_of_word(begin, last);
    if (end == begin) return {first, std::errc::invalid_argument};
    std::string text(first, end);
    const bool is_zero = std::all_of(begin, end, [&, before = true](char c) mutable {
        before = before && c != 'e' && c != 'E';
        return !before || c == '0' || c == '.';
    });
    if (const std::size_t point = text.find('.'); point != std::string::npos)
        text.replace(point, 1, std::localeconv()->decimal_point);
    const double number = std::strtod(text.c_str(), nullptr);
    if (!is_word && (std::isinf(number) || (number == 0 && !is_zero)))
        return {end, std::errc::result_out_of_range};
    value = number;
    return {end, std::errc()};
}

std::optional<std::vector<double>> number_list(std::string_view text) {
    std::vector<double> values;
    const char *at = text.data(), *const end = at + text.size();
    while (at <= end) {
        double value = 0;
        const auto [rest, error] = parse_number(at, end, value);
        if (error != std::errc{} || !std::isfinite(value) || (rest != end && *rest != ','))
            return std::nullopt;
        values.push_back(value);
        at = rest + 1;
    }
    return values;
}

std::vector<double> numbers_from(const std::string& option, const std::string& text,
                                 std::size_t count) {
    std::optional<std::vector<double>> values = number_list(text);
    if (!values || values->size() != count)
        throw Error(option, fmt::format("'{}' is not {} numbers", text, count),
                    "Write them with commas and without spaces.");
    return std::move(*values);
}

}  // namespace darb
