// SPDX-License-Identifier: MIT
// The table of strategies: names, numbers, and what each of them knows.
#include <gtest/gtest.h>

#include "trainer/options/strategy.h"

namespace darb {
namespace {

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
