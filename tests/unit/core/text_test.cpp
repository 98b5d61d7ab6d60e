// SPDX-License-Identifier: MIT
// How names from files appear on a terminal and in Python source.
#include "engine/core/text.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>

#include "engine/core/files.h"
#include "engine/core/rng.h"

namespace darb {
namespace {

TEST(Printable, control_characters_and_marks_of_direction_are_escaped) {
    EXPECT_EQ(printable("a.ply"), "a.ply");
    EXPECT_EQ(printable("gr\xc3\xbc\xc3\x9f \xe6\x97\xa5 \xf0\x9f\x98\x80"),
              "gr\xc3\xbc\xc3\x9f \xe6\x97\xa5 \xf0\x9f\x98\x80");
    EXPECT_EQ(printable("\x1b[31mred\x07\x7f\r\n"), "\\x1b[31mred\\x07\\x7f\\x0d\\x0a");
    EXPECT_EQ(printable("a\nb\x1b", true), "a\nb\\x1b");
    EXPECT_EQ(printable("\xc2\x9b"
                        "2J \xe2\x80\xae"),
              "\\x9b2J \\u202e");
    EXPECT_EQ(printable("\xff\xc3"), "\\xff\\xc3");
    EXPECT_EQ(printable(std::string_view("\0", 1)), "\\x00");
}

TEST(PythonString, is_quoted_as_python_does) {
    EXPECT_EQ(python_string("/photos"), "'/photos'");
    EXPECT_EQ(python_string("it's"), "\"it's\"");
    EXPECT_EQ(python_string("'\"\\\n"), R"('\'"\\\n')");
    EXPECT_EQ(python_string("\xc3\xbc\xff"), R"('\xfc\udcff')");
    EXPECT_EQ(python_string("\xed\xa0\x80"), R"('\udced\udca0\udc80')");  // half of a pair
}

/// Bytes that break quoting: quotes, backslashes, line ends, UTF-8 whole and cut, anything.
std::string random_name(Pcg32& rng) {
    constexpr std::string_view kParts[] = {"'",
                                           "\"",
                                           "\\",
                                           "\n",
                                           "\r",
                                           "\t",
                                           "')+__import__('os')",
                                           "\\x",
                                           "\\N{",
                                           "{",
                                           "\xe2\x80\xae",
                                           "\xe2\x80\xa8",
                                           "\xc3\xa9",
                                           "\xf0\x9f\x98\x80",
                                           "\xed\xb0\x80",
                                           "\xc0\xaf",
                                           "\xf4\x90\x80\x80",
                                           "#",
                                           "a",
                                           "%"};
    std::string name;
    for (std::uint32_t i = rng.below(12); i > 0; --i)
        if (rng.below(3) == 0)
            name += static_cast<char>(rng.below(256));
        else
            name += kParts[rng.below(std::size(kParts))];
    return name;
}

TEST(PythonString, random_names_are_read_back_by_python) {
    if (std::system("python3 -c 1 >/dev/null 2>&1") != 0) GTEST_SKIP() << "there is no python3";
    Pcg32 rng(36);
    std::string lines;
    for (int i = 0; i < 20000; ++i) {
        const std::string name = random_name(rng);
        for (const char c : name) {
            constexpr char kDigits[] = "0123456789abcdef";
            lines += kDigits[static_cast<std::uint8_t>(c) >> 4];
            lines += kDigits[static_cast<std::uint8_t>(c) & 15];
        }
        lines += " " + python_string(name) + "\n";
    }
    const auto file =
        std::filesystem::temp_directory_path() / ("darb_names_" + std::to_string(getpid()));
    write_file_atomic(file, lines);
    const std::string command =
        "python3 -c 'import ast, sys\n"
        "for line in open(sys.argv[1], encoding=\"ascii\"):\n"
        "    name, text = line[:-1].split(\" \", 1)\n"
        "    name = bytes.fromhex(name).decode(\"utf-8\", \"surrogateescape\")\n"
        "    assert ast.literal_eval(text) == name and ascii(name) == text, line\n' " +
        file.string();
    EXPECT_EQ(std::system(command.c_str()), 0);
    std::filesystem::remove(file);
}

}  // namespace
}  // namespace darb
