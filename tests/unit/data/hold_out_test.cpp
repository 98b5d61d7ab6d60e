// Which views are held out: every so many, an arc, both, and what a source says of its own.
#include "engine/data/hold_out.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "engine/core/error.h"
#include "engine/data/dataset.h"

namespace darb {
namespace {

// Looks from `at` to `to`, y down, z up in the world.
View looking(const glm::dvec3& at, const glm::dvec3& to, int name) {
    View view;
    view.name = std::to_string(1000 + name);
    const glm::dvec3 ahead = glm::normalize(to - at);
    const glm::dvec3 right = glm::normalize(glm::cross(ahead, glm::dvec3(0, 0, 1)));
    const glm::dvec3 down = glm::cross(ahead, right);
    view.camera.rotation = glm::transpose(glm::dmat3(right, down, ahead));
    view.camera.translation = -(view.camera.rotation * at);
    return view;
}

constexpr double kTurn = 6.283185307179586;

// count views on `share` of a turn around (5, 5, 0), by name out of order.
std::vector<View> ring(int count, double share = 1) {
    std::vector<View> views;
    for (int i = 0; i < count; ++i) {
        const double angle = kTurn * share * ((i * 7) % count) / count;
        views.push_back(
            looking({5 + 3 * std::cos(angle), 5 + 3 * std::sin(angle), 1}, {5, 5, 0}, i));
    }
    return views;
}

std::set<int> places(const std::vector<View>& views, bool View::*which) {
    std::set<int> held;  // places on the ring
    for (std::size_t i = 0; i < views.size(); ++i)
        if (views[i].*which) held.insert(static_cast<int>(i * 7 % views.size()));
    return held;
}

TEST(HoldOut, words_are_read_and_written) {
    EXPECT_EQ(hold_out_text({}), "every:8");
    EXPECT_EQ(parse_hold_out("every:8"), HoldOut{});
    EXPECT_EQ(parse_hold_out("arc"), (HoldOut{0, 8}));
    EXPECT_EQ(parse_hold_out("every,arc:5"), (HoldOut{8, 5}));
    EXPECT_EQ(hold_out_text({4, 5}), "every:4,arc:5");
    EXPECT_EQ(parse_hold_out(hold_out_text({0, 3})), (HoldOut{0, 3}));
    for (const char* wrong : {"", "arc:1", "arc:", "arc:x", "arc:3x", "ring", "arc,arc", "every:-2",
                              "every:8,", "arc:99999999999"})
        EXPECT_THROW(parse_hold_out(wrong), Error) << wrong;
}

TEST(HoldOut, every_eighth_by_name_unless_the_source_says) {
    std::vector<View> views = ring(20);
    mark_held_out(views, {});
    for (std::size_t i = 0; i < views.size(); ++i) EXPECT_EQ(views[i].is_test, i % 8 == 0) << i;
    views = ring(20);
    views[3].is_test = true;
    mark_held_out(views, {});
    for (std::size_t i = 0; i < views.size(); ++i) EXPECT_EQ(views[i].is_test, i == 3) << i;
}

TEST(HoldOut, arc_is_one_stretch_of_the_way_around) {
    for (const double share : {1.0, 0.4}) {
        std::vector<View> views = ring(20, share);
        mark_held_out(views, {0, 4});
        const std::set<int> held = places(views, &View::in_arc);
        ASSERT_EQ(held.size(), 5u);
        EXPECT_EQ(places(views, &View::is_test), held);
        int ends = 0;  // held, and the next on the ring is not
        for (const int p : held) ends += held.contains((p + 1) % 20) ? 0 : 1;
        EXPECT_EQ(ends, 1);
        // Of an open way the middle, so that there are photos on both sides.
        if (share < 1) {
            EXPECT_EQ(held, (std::set<int>{7, 8, 9, 10, 11}));
        }
    }
}

TEST(HoldOut, both_and_the_sources_own_views_stay_apart) {
    std::vector<View> views = ring(20);
    mark_held_out(views, {5, 4});
    const std::set<int> arc = places(views, &View::in_arc), all = places(views, &View::is_test);
    EXPECT_EQ(arc.size(), 5u);
    EXPECT_EQ(all.size(), 8u) << "every fifth of the other 15";
    views = ring(20, 0.4);
    views[0].is_test = true;  // place 0, at the end of the way
    mark_held_out(views, {0, 4});
    EXPECT_TRUE(views[0].is_test && !views[0].in_arc);
    EXPECT_EQ(places(views, &View::is_test).size(), 6u);
}

TEST(HoldOut, cameras_in_one_place_go_by_where_they_look) {
    std::vector<View> views;
    for (int i = 0; i < 12; ++i) {
        const double angle = kTurn * ((i * 7) % 12) / 12;
        views.push_back(looking({2, 2, 2}, {2 + std::cos(angle), 2 + std::sin(angle), 2}, i));
    }
    const std::vector<std::size_t> order = way_round(views);
    ASSERT_EQ(order.size(), 12u);
    for (std::size_t k = 1; k < order.size(); ++k) {
        const int step =
            static_cast<int>(order[k] * 7 % 12) - static_cast<int>(order[k - 1] * 7 % 12);
        EXPECT_TRUE((step + 12) % 12 == 1 || (step + 12) % 12 == 11) << k;
    }
}

TEST(HoldOut, few_views_leave_one_to_train_on) {
    std::vector<View> one = ring(1), two = ring(2);
    mark_held_out(one, {0, 2});
    EXPECT_FALSE(one[0].is_test);
    mark_held_out(two, {0, 2});
    EXPECT_NE(two[0].is_test, two[1].is_test);
}

}  // namespace
}  // namespace darb
