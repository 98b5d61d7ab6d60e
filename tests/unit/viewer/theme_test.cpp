// SPDX-License-Identifier: MIT
#include "viewer/gui.h"

#include <gtest/gtest.h>

namespace darb {
namespace {

TEST(Theme, Contrast_is_that_of_wcag) {
    EXPECT_NEAR(contrast({0, 0, 0, 1}, {1, 1, 1, 1}), 21, 1e-9);
    EXPECT_NEAR(contrast({1, 0, 0, 1}, {1, 1, 1, 1}), 3.998, 1e-3);  // their own example, #F00
    EXPECT_EQ(contrast({0.3f, 0.2f, 0.1f, 1}, {0.3f, 0.2f, 0.1f, 1}), 1);
}

TEST(Theme, Text_is_read_on_every_ground) {
    for (const ThemeColour& ground : theme::kGrounds) {
        EXPECT_GE(contrast(theme::kText, ground), 7) << ground[0] << ' ' << ground[1];
        EXPECT_GE(contrast(theme::kTextOff, ground), 4.5) << ground[0] << ' ' << ground[1];
    }
    EXPECT_GE(contrast(theme::kText, theme::kGrab), 4.5);
}

}  // namespace
}  // namespace darb
