// SPDX-License-Identifier: MIT
// The help of the built darb command, and what it says to words that it does not know.

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>

#include "tests/support/run_command.h"
#include "trainer/options/option_table.h"

namespace darb {
namespace {

using namespace test;

using test::kScene;

TEST(Help, help_of_train_shows_what_a_user_needs_and_all_of_it_the_table) {
    const std::string brief = darb("train --help").out, all = darb("train --help-all").out;
    for (const char* flag : {"--iterations", "--kernel", "--strategy", "--resume", "--max-splats"})
        EXPECT_NE(brief.find(flag), std::string::npos) << flag;
    for (const OptionRow& row : option_rows())
        if (*row.flags != '\0') {
            EXPECT_NE(all.find(option_name(row)), std::string::npos) << row.flags;
        }
    EXPECT_LT(std::count(brief.begin(), brief.end(), '\n'), 60);
    EXPECT_EQ(all.find("--deterministic"), std::string::npos) << "accepted, and means nothing";
    for (const std::string& text : {brief, all}) {
        std::istringstream lines(text);
        for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
    }
    const std::string commands = darb("--help").out;
    for (const char* group : {"Scenes:", "Insight:", "Paper:"})
        EXPECT_NE(commands.find(group), std::string::npos) << commands;
}

TEST(Help, a_word_that_is_near_an_option_or_a_command_is_asked_for) {
    const std::string train = "train " + kScene + " -o " + (scratch() / "unused").string();
    expect_refused({{train + " --iteratons 7", "Did you mean --iterations?"},
                    {"rendr a.ply", "Did you mean render?"},
                    {train + " more", "is one argument too many"},
                    {train + " --final-lr-share 1", "--average-from"},
                    {train + " --max-memory -1", "--max-memory -1: must be"},
                    {train + " --seed -1", "--seed -1: must be a whole number"},
                    {train + " --random-points 0", "--random-points 0: must be"},
                    {train + " --save-iterations -5", "--save-iterations"}});
    const Outcome late = darb(train + " -r 8 --iterations 1 --no-report --save-iterations 9");
    EXPECT_EQ(late.code, 0) << late.err;
    EXPECT_NE(late.err.find("--save-iterations 9 is beyond the end at 1"), std::string::npos);
}

}  // namespace
}  // namespace darb
