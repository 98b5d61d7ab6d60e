// SPDX-License-Identifier: MIT
// DARB_CHECK and Error: what a developer and a user read when something is wrong.
#include "engine/core/error.h"

#include <gtest/gtest.h>

namespace darb {
namespace {

TEST(CheckDeathTest, Check_false_prints_place_expression_and_values) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    const int index = 7;
    EXPECT_DEATH(DARB_CHECK(index < 3, "index = {}, n = {}", index, 3),
                 "check_test.cpp:[0-9]+: check failed: index < 3: index = 7, n = 3");
    EXPECT_DEATH(DARB_CHECK(index < 3), "check failed: index < 3");
}

TEST(Check, Check_true_evaluates_the_expression_once_and_no_values) {
    int expressions = 0, values = 0;
    DARB_CHECK(++expressions == 1, "{}", ++values);
    EXPECT_EQ(expressions, 1);
    EXPECT_EQ(values, 0);
}

TEST(Check, Check_in_an_if_without_braces_keeps_its_else) {
    bool reached_else = false;
    if (reached_else)
        DARB_CHECK(false);
    else
        reached_else = true;
    EXPECT_TRUE(reached_else);
}

TEST(Error, Error_with_hint_holds_its_parts_and_joins_them) {
    const Error error("scene.ply:12", "opacity is missing", "Export it again.");
    EXPECT_STREQ(error.what(), "scene.ply:12: opacity is missing\n  Export it again.");
    EXPECT_EQ(error.where, "scene.ply:12");
    EXPECT_EQ(error.reason, "opacity is missing");
    EXPECT_EQ(error.hint, "Export it again.");
}

TEST(Error, Error_without_hint_is_one_line) {
    EXPECT_STREQ(Error("lavapipe", "out of memory").what(), "lavapipe: out of memory");
}

}  // namespace
}  // namespace darb
