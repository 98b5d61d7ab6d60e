// SPDX-License-Identifier: MIT
#include "engine/core/process.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <fstream>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/memory.h"
#include "engine/core/scope_guard.h"
#include "engine/core/system.h"
#include "engine/core/system_files.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

// This program again, with one of the cases below, which are no tests of their own.
std::vector<std::string> own(const std::string& part) {
    return {program_file().string(), "--gtest_also_run_disabled_tests",
            "--gtest_filter=ProcessParts.DISABLED_" + part};
}

TEST(ProcessParts, DISABLED_says_what_it_was_given) {
    std::printf("out: %s\n", environment("DARB_TEST_WORD").value_or("none").c_str());
    std::fprintf(stderr, "errors\n");
    char line[100] = "";
    std::printf("input: %s\n", std::fgets(line, sizeof line, stdin) == nullptr ? "none" : line);
}

TEST(ProcessParts, DISABLED_fails) {
    std::exit(3);
}

TEST(ProcessParts, DISABLED_waits) {
    std::printf("begun\n");
    std::fflush(stdout);
    for (const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
         std::chrono::steady_clock::now() < end;) {
    }
}

TEST(Process, its_output_variables_and_input_are_as_asked) {
    const fs::path folder = make_scratch_folder("darb_process");
    const ScopeGuard remove([&] { fs::remove_all(folder); });
    std::string printed;
    const ProcessEnd ended = run_process(own("says_what_it_was_given"),
                                         {.variables = {{"DARB_TEST_WORD", "a 'b' \"c\" \u00fc"}},
                                          .errors_file = folder / "errors",
                                          .no_input = true},
                                         &printed);
    EXPECT_TRUE(ended.is_good());
    EXPECT_NE(printed.find("out: a 'b' \"c\" \u00fc"), std::string::npos) << printed;
    EXPECT_NE(printed.find("input: none"), std::string::npos) << printed;
    EXPECT_EQ(printed.find("errors\n"), std::string::npos) << printed;
    EXPECT_EQ(read_text_file(folder / "errors").substr(0, 6), "errors");
    printed.clear();
    run_process(own("says_what_it_was_given"),
                {.errors = ProcessOptions::Output::piped, .no_input = true}, &printed);
    EXPECT_NE(printed.find("out: none"), std::string::npos) << printed;
    EXPECT_NE(printed.find("errors"), std::string::npos) << printed;
}

TEST(Process, exit_codes_come_back_and_a_program_that_is_not_there_is_an_error) {
    EXPECT_EQ(run_process(own("fails"), {.output = ProcessOptions::Output::nowhere}).code, 3);
    try {
        ChildProcess none({"darb_no_such_program"});
        FAIL() << "started";
    } catch (const Error& e) {
        EXPECT_EQ(e.where, "darb_no_such_program");
        EXPECT_NE(e.reason.find("cannot be started"), std::string::npos) << e.reason;
    }
    EXPECT_FALSE(is_installed("darb_no_such_program"));
    EXPECT_TRUE(is_installed(program_file().string()));
}

TEST(Process, reading_waits_no_longer_than_asked_and_the_end_ends_it) {
    for (const bool tied : {false, true}) {
        const auto begun = std::chrono::steady_clock::now();
        {
            ChildProcess child(own("waits"),
                               {.output = ProcessOptions::Output::piped, .ends_with_this = tied});
            std::array<char, 256> part;
            std::string text;
            while (text.find("begun") == std::string::npos) {
                const std::size_t count = child.read(part).value_or(0);
                ASSERT_GT(count, 0u) << text;
                text.append(part.data(), count);
            }
            EXPECT_FALSE(child.read(part, 50));
            EXPECT_FALSE(child.look());
        }
        EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(50));
    }
}

// What CommandLineToArgvW makes of them.
TEST(Process, words_are_quoted_as_windows_takes_them_apart) {
    EXPECT_EQ(windows_command_line({"darb", "a b", ""}), R"(darb "a b" "")");
    EXPECT_EQ(windows_command_line({R"(C:\x y\)", R"(say "it")", R"(a\b)"}),
              R"("C:\x y\\" "say \"it\"" a\b)");
    EXPECT_EQ(windows_command_line({R"(end\" x)"}), R"("end\\\" x")");
}

TEST(System, says_what_it_knows_of_this_process_and_the_machine) {
    EXPECT_TRUE(fs::is_regular_file(program_file()));
    EXPECT_GT(process_id(), 0);
    EXPECT_FALSE(host_name().empty());
    EXPECT_FALSE(processor_name().empty());
    EXPECT_FALSE(scheduling().empty());
    EXPECT_GT(peak_memory_bytes(), 1e5);
    EXPECT_GT(free_memory(), std::uint64_t{1} << 20);
    const double before = processor_seconds();
    volatile double sum = 0;
    while (processor_seconds() < before + 0.05) sum = sum + 1;
    EXPECT_GE(machine_busy_seconds(), 0);
}

TEST(System, the_environment_is_utf8_and_set_once) {
    EXPECT_FALSE(environment("DARB_TEST_UNSET"));
    set_missing_environment("DARB_TEST_SET", "Z\u00fcrich \u65e5\u672c");
    set_missing_environment("DARB_TEST_SET", "other");
    EXPECT_EQ(environment("DARB_TEST_SET"), "Z\u00fcrich \u65e5\u672c");
}

TEST(System, a_library_that_is_not_there_has_no_functions) {
    EXPECT_EQ(loaded_function("libdarb_no_such_library.so", "f"), nullptr);
    EXPECT_EQ(loaded_function(nullptr, "darb_no_such_function"), nullptr);
    EXPECT_FALSE(can_load_library("libdarb_no_such_library.so"));
}

}  // namespace
}  // namespace darb
