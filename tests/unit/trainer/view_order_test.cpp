// SPDX-License-Identifier: MIT
// trainer/view_order: every epoch shows each view once, in an order that repeats.
#include "trainer/step/trainer.h"

#include <gtest/gtest.h>

#include <set>

namespace darb {
namespace {

const std::vector<int> kViews{1, 2, 4, 7, 9, 12};

TEST(ViewOrder, an_epoch_shows_each_view_once) {
    ViewOrder order(kViews, 3);
    for (int epoch = 0; epoch < 5; ++epoch) {
        std::set<int> seen;
        for (int i = 1; i <= 6; ++i) seen.insert(order.view(epoch * 6 + i));
        EXPECT_EQ(seen, std::set<int>(kViews.begin(), kViews.end())) << epoch;
    }
}

TEST(ViewOrder, does_not_depend_on_the_order_of_calls) {
    ViewOrder forwards(kViews, 3), backwards(kViews, 3);
    std::vector<int> views;
    for (int i = 1; i <= 30; ++i) views.push_back(forwards.view(i));
    for (int i = 30; i >= 1; --i) EXPECT_EQ(backwards.view(i), views[static_cast<size_t>(i) - 1]);
}

TEST(ViewOrder, follows_the_seed_and_the_epoch) {
    const auto of = [](std::uint64_t seed, int first) {
        ViewOrder order(kViews, seed);
        std::vector<int> views;
        for (int i = first; i < first + 6; ++i) views.push_back(order.view(i));
        return views;
    };
    EXPECT_EQ(of(3, 1), of(3, 1));
    EXPECT_NE(of(3, 1), of(4, 1));
    EXPECT_NE(of(3, 1), of(3, 7));
}

TEST(ViewOrder, counts_the_visits_of_some_views) {
    ViewOrder order(kViews, 3);
    const auto is_one = [](int view) { return view == 4 || view == 9; };
    int visits = 0;
    for (int i = 1; i <= 20; ++i) {
        visits += is_one(order.view(i)) ? 1 : 0;
        EXPECT_EQ(order.visits(i, is_one), visits) << i;
    }
}

TEST(ExposureNumbers, are_one_a_photo_and_faces_of_a_panorama_are_one_photo) {
    std::vector<View> views(8);
    for (size_t v = 0; v < views.size(); ++v) views[v].photo = v < 4 ? "a.jpg" : "b.jpg";
    for (const size_t v : {0, 1, 2, 4, 5}) views[v].face = static_cast<int>(v);
    views[1].is_test = true;  // and 3, 6 and 7 are flat photos, whatever they are named
    EXPECT_EQ(exposure_numbers(views), (std::vector<std::uint32_t>{0, 0, 1, 2, 2, 3, 4}));
    EXPECT_EQ(exposure_count(views), 5U);
    EXPECT_EQ(exposure_count({}), 0U);
}

}  // namespace
}  // namespace darb
