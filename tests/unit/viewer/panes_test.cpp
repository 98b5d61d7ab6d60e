// SPDX-License-Identifier: MIT
#include "viewer/panes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace darb {
namespace {

TEST(Panes, Lines_are_even_at_first_and_stay_where_they_were_put) {
    Panes p;
    fit_lines(4, p);
    EXPECT_EQ(p.lines, (std::vector<float>{0.25f, 0.5f, 0.75f}));
    move_line(1, 0.6f, p);
    fit_lines(4, p);
    EXPECT_EQ(p.lines[1], 0.6f);
    fit_lines(1, p);
    EXPECT_TRUE(p.lines.empty());
    fit_lines(2, p, {0.5f, 0.75f});
    EXPECT_EQ(p.lines, std::vector<float>{0.625f});
    fit_lines(0, p);
    EXPECT_TRUE(p.lines.empty());
}

TEST(Panes, A_line_stays_between_its_neighbours_and_in_the_window) {
    Panes p;
    fit_lines(3, p);
    move_line(0, 2, p);
    EXPECT_LT(p.lines[0], p.lines[1]);
    EXPECT_GT(p.lines[0], 0.6f);
    move_line(1, -1, p);
    EXPECT_GT(p.lines[1], p.lines[0]);
    move_line(0, -1, p);
    move_line(1, 7, p);
    EXPECT_EQ(p.lines, (std::vector<float>{0, 1}));
    move_line(1, std::nanf(""), p);
    move_line(5, 0.5f, p);
    EXPECT_EQ(p.lines, (std::vector<float>{0, 1}));
}

TEST(Panes, Edges_cover_the_width_once) {
    EXPECT_EQ(pane_edges({}, 7), (std::vector<int>{0, 7}));
    EXPECT_EQ(pane_edges({0.25f, 0.5f}, 100), (std::vector<int>{0, 25, 50, 100}));
    EXPECT_EQ(pane_edges({0.5f, 0.2f}, 10), (std::vector<int>{0, 5, 5, 10}));
    EXPECT_EQ(pane_edges({0.0f, 1.0f}, 10), (std::vector<int>{0, 0, 10, 10}));
}

// One channel of two pixels differs by 51, a fifth of white: mse = 0.04 / 6.
TEST(Panes, Psnr_is_of_the_pixels_that_both_have) {
    const std::vector<std::uint32_t> a{0xFF000033, 0xFF102030, 0x00FFFFFF},
        b{0xFF000000, 0xFF102030, 0xFF000000};
    EXPECT_NEAR(pixels_psnr_db(a, b), 10 * std::log10(6 / 0.04), 1e-9);
    EXPECT_TRUE(std::isinf(pixels_psnr_db(a, a)));
    EXPECT_TRUE(std::isnan(pixels_psnr_db(std::span(a).last(1), std::span(b).last(1))));
}

}  // namespace
}  // namespace darb
