// The table of strategies is the only switch between them: nothing else in the sources asks for one
// by its name.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "engine/core/files.h"
#include "trainer/options/strategy.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

/// Files below `folders` that contain one of these texts.
std::vector<std::string> files_with(const std::vector<std::string>& folders,
                                    const std::vector<std::string>& texts) {
    const fs::path root = DARB_SOURCE_DIR;
    std::vector<std::string> found;
    for (const std::string& folder : folders)
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder)) {
            const std::string extension = entry.path().extension().string();
            if (extension != ".cpp" && extension != ".h") continue;
            const std::string content = read_text_file(entry.path());
            const bool names = std::any_of(texts.begin(), texts.end(), [&](const auto& text) {
                return content.find(text) != std::string::npos;
            });
            if (names) found.push_back(fs::relative(entry.path(), root).generic_string());
        }
    std::sort(found.begin(), found.end());
    return found;
}

TEST(StrategyTable, a_name_stands_in_its_own_file_and_in_the_table_alone) {
    for (const Strategy strategy : all_strategies()) {
        const std::string name(strategy_name(strategy));
        SCOPED_TRACE(name);
        EXPECT_TRUE(
            files_with({"engine", "trainer", "tools", "viewer"}, {"Strategy::" + name}).empty());
        std::vector<std::string> named =
            files_with({"engine", "trainer", "viewer"}, {'"' + name + '"', name + "_row()"});
        std::erase(named, "trainer/options/option_rows.cpp");  // whose options say what they are for
        EXPECT_EQ(named, std::vector<std::string>{"trainer/growth/" + name + ".cpp"});
        EXPECT_EQ(files_with({"trainer"}, {"ROW(" + name + ")"}),
                  std::vector<std::string>{"trainer/options/options.h"});
    }
}

TEST(StrategyTable, names_and_numbers_lead_to_each_other) {
    for (const Strategy strategy : all_strategies())
        EXPECT_EQ(strategy_from_name(strategy_name(strategy)), strategy);
    EXPECT_EQ(strategy_from_name("no such strategy"), std::nullopt);
    EXPECT_EQ(strategy_name(TrainOptions{}.strategy), strategy_name(all_strategies().front()));
}

TEST(StrategyTable, names_are_listed_as_people_do) {
    const std::string names = strategy_names();
    EXPECT_NE(names.find(" or "), std::string::npos) << names;
    for (const Strategy strategy : all_strategies())
        EXPECT_NE(names.find(strategy_name(strategy)), std::string::npos) << names;
}

}  // namespace
}  // namespace darb
