// SPDX-License-Identifier: MIT
// Numbers in text: what stands in for std::from_chars reads as that does.
#include "engine/core/parse_number.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace darb {
namespace {

#ifdef __cpp_lib_to_chars
void expect_same(const std::string& text) {
    double by_strtod = 7, by_chars = 7;
    const char *const first = text.data(), *const last = first + text.size();
    const std::from_chars_result got = double_by_strtod(first, last, by_strtod);
    const std::from_chars_result want = std::from_chars(first, last, by_chars);
    EXPECT_EQ(got.ptr - first, want.ptr - first) << text;
    EXPECT_EQ(got.ec, want.ec) << text;
    EXPECT_EQ(std::bit_cast<std::uint64_t>(by_strtod), std::bit_cast<std::uint64_t>(by_chars))
        << text;
}

TEST(ParseNumber, strtod_reads_words_as_from_chars_does) {
    for (const char* text : {"",
                             "-",
                             "+1",
                             " 1",
                             "1",
                             "-0",
                             "0x10",
                             "1e",
                             "1e+",
                             "1e-",
                             "1e5x",
                             ".5",
                             "5.",
                             ".",
                             "-.",
                             "1..2",
                             "1,5",
                             "1 2",
                             "1e400",
                             "-1e400",
                             "1e-400",
                             "0e9999",
                             "4.9e-324",
                             "1e-310",
                             "inf",
                             "-inf",
                             "INFINITY",
                             "infin",
                             "nan",
                             "-nan",
                             "nano",
                             "--1",
                             "1-2",
                             "e5",
                             "1E+05",
                             "00012.50",
                             "0.1",
                             "9007199254740993",
                             "123456789012345678901234567890"})
        expect_same(text);
}

TEST(ParseNumber, strtod_reads_every_double_as_from_chars_does) {
    std::mt19937_64 random(5);
    for (int i = 0; i < 20000; ++i) {
        const double value = std::bit_cast<double>(random());
        for (const char* form : {"{}", "{:e}", "{:.3f}", "{:.30g}"}) {
            const std::string text = fmt::format(fmt::runtime(form), value);
            if (text.size() < 400) expect_same(text);
        }
    }
}
#endif

TEST(ParseNumber, reads_whole_numbers_and_ends_where_they_end) {
    const std::string text = "-12;";
    int value = 0;
    const auto [end, error] = parse_number(text.data(), text.data() + text.size(), value);
    EXPECT_EQ(error, std::errc());
    EXPECT_EQ(value, -12);
    EXPECT_EQ(*end, ';');
}

}  // namespace
}  // namespace darb
