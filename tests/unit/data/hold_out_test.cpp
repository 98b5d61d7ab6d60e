// SPDX-License-Identifier: MIT
// Which views are held out: every N-th, an arc, both, and what a source itself states.
#include "engine/data/hold_out.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include <filesystem>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/dataset.h"
#include "tests/unit/data/data_files.h"

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

// `count` views on a share of a turn around (5, 5, 0), with names out of order.
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
        // Where the way round is open, the arc is in its middle, with photos on both sides.
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

// Views with photos in a folder: text[i] is the content of the photo of view i.
std::vector<View> with_photos(std::vector<View> views, const std::vector<std::string>& text) {
    const auto folder = test_folder();
    for (std::size_t i = 0; i < views.size(); ++i) {
        views[i].photo = folder / (views[i].name + ".jpg");
        write_file_atomic(views[i].photo, text[i]);
    }
    return views;
}

std::vector<std::string> distinct(int count) {
    std::vector<std::string> text;
    for (int i = 0; i < count; ++i) text.push_back(std::to_string(10'000 + i));
    return text;
}

TEST(HoldOut, views_of_one_photo_are_on_one_side) {
    const std::vector<View> views = with_photos(ring(20), distinct(20));
    std::vector<View> plain = views;
    EXPECT_EQ(mark_held_out(plain, {}), "");
    // A name twice, a copy under another name, a hard link; files of equal size that differ.
    std::vector<View> repeated = views;
    repeated[3].photo = repeated[0].photo;
    std::filesystem::copy_file(views[0].photo, views[12].photo,
                               std::filesystem::copy_options::overwrite_existing);
    std::filesystem::remove(views[19].photo);
    std::filesystem::create_hard_link(views[1].photo, views[19].photo);
    const std::vector<std::size_t> first = first_of_photo(repeated);
    for (std::size_t i = 0; i < first.size(); ++i)
        EXPECT_EQ(first[i], i == 3 || i == 12 ? 0 : i == 19 ? 1 : i) << i;
    const std::string note = mark_held_out(repeated, {});
    EXPECT_NE(note.find("3 views repeat"), std::string::npos) << note;
    EXPECT_NE(note.find("1003 repeats 1000"), std::string::npos) << note;
    EXPECT_NE(note.find("2 of the repeats are held out, 1 trained on"), std::string::npos) << note;
    // Every eighth photo: rows 0, 9 and 18, because rows 3 and 12 repeat photos.
    for (std::size_t i = 0; i < repeated.size(); ++i)
        EXPECT_EQ(repeated[i].is_test, i == 0 || i == 3 || i == 12 || i == 9 || i == 18) << i;
}

TEST(HoldOut, repeats_follow_an_arc_and_the_sources_own_views) {
    std::vector<View> views = with_photos(ring(20), distinct(20));
    for (std::size_t i = 0; i < 20; ++i)  // the photo on the other side of the ring
        if (i % 2 == 1) views[i].photo = views[(i + 10) % 20].photo;
    std::vector<View> arc = views, own = views, all = with_photos(ring(4), {"a", "b", "a", "b"});
    mark_held_out(arc, {8, 4});
    mark_held_out(own, {});
    own = views;
    own[1].is_test = true;
    mark_held_out(own, {});
    const std::vector<std::size_t> first = first_of_photo(views);
    for (std::size_t i = 0; i < 20; ++i) {
        EXPECT_EQ(arc[i].is_test, arc[first[i]].is_test) << i;
        EXPECT_EQ(arc[i].in_arc, arc[first[i]].in_arc) << i;
        EXPECT_EQ(own[i].is_test, first[i] == first[1]) << i;
    }
    // A test list that repeats all training photos is kept, or nothing would be left to train on.
    all[0].is_test = all[1].is_test = true;
    const std::string note = mark_held_out(all, {});
    EXPECT_NE(note.find("no measure of new views"), std::string::npos) << note;
    EXPECT_FALSE(all[2].is_test || all[3].is_test);
}

}  // namespace
}  // namespace darb
