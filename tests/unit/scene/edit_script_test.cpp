// SPDX-License-Identifier: MIT
// Edits as values: each reads back as it was written, mistakes are named, and a replay gives the
// same bits.
#include "engine/scene/edit_script.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "engine/core/error.h"
#include "engine/scene/edit.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

SplatModel some_scene(std::uint64_t seed, std::size_t count = 80) {
    SceneOptions options;
    options.count = count;
    options.sh_degree = 2;
    options.seed = seed;
    return random_scene(options).model;
}

void expect_same(const SplatModel& a, const SplatModel& b) {
    EXPECT_EQ(a.kernel, b.kernel);
    EXPECT_EQ(a.sh_degree, b.sh_degree);
    EXPECT_EQ(a.origin, b.origin);
    EXPECT_EQ(a.metres_per_unit, b.metres_per_unit);
    for (int attribute = 0; attribute < kAttributeCount; ++attribute)
        EXPECT_EQ(attribute_values(a, attribute), attribute_values(b, attribute)) << attribute;
}

Camera a_view() {
    Camera c;
    c.width = 96;
    c.height = 64;
    c.fx = c.fy = 70.1;
    c.cx = 48.3;
    c.cy = 31.7;
    c.rotation = turn_of_degrees({10, 20, 30});
    c.translation = {0.1, 0.2, 4};
    return c;
}

Similarity a_move() {
    return {1.1, turn_of_degrees({5, -7, 11}), {0.3, 0.1, -0.2}};
}

// Every operation, and every way to select.
std::vector<EditOperation> every_edit() {
    using namespace edits;
    const std::vector<glm::dvec2> line{{10, 5.25}, {80, 9}, {60, 55}};
    return {
        Select{by::Everything{}},
        Select{Region{Region::Shape::sphere, {0.1, 0.2, 0.3}, glm::dvec3(1.0 / 3)}},
        Select{Region{Region::Shape::box, {0, 0, 0.1}, {1, 0.5, 1}}, Combine::add},
        Select{Region{Region::Shape::prism,
                      glm::dvec3(0.0),
                      glm::dvec3(1.0),
                      {{0, 0.1, 0},
                       {1, 0, 0},
                       {0, 0, 1},
                       {0, -1, 0},
                       {{-0.5, -0.5}, {0.7, -0.5}, {0, 1.0 / 3}},
                       -0.3,
                       0.4}},
               Combine::add},
        Select{by::Rectangle{a_view(), {10, 10}, {60, 40}}, Combine::subtract},
        Select{by::Polygon{a_view(), line}, Combine::add},
        Select{by::Brush{a_view(), line, 7.5}, Combine::add},
        Invert{},
        Select{by::Opacity{0.2, 0.7}},
        Select{by::Size{0.01, 0.3}, Combine::add},
        Select{by::Colour{{0.5, 0.4, 0.6}, 0.3}, Combine::subtract},
        Hide{},
        Select{by::Isolated{0.02}},
        Select{by::Haze{0.3, 1.5}, Combine::add},
        Select{by::Near{0.2}, Combine::add},
        Transform{a_move(), ""},
        Show{},
        Select{by::Numbers{{{3, 2}, {9, 1}}}},
        Select{by::Connected{}, Combine::add},
        Select{by::Flood{{0.1, 0.2, 0.3}, 0.25}, Combine::add},
        Remove{},
        Remove{Region{Region::Shape::sphere, {2, 2, 2}, glm::dvec3(0.4)}, false},
        Remove{by::Opacity{0.05, 1}, true},
        Add{fs::absolute("folder/other scene.ply").lexically_normal(), "other"},
        Transform{a_move(), "other"},
        Duplicate{"other", "twin"},
        RenameLayer{"twin", "third"},
        PlaceLayer{"third", 0},
        ShowLayer{"other", false},
        ShowLayer{"other", true},
        Select{by::Layer{"other"}},
        Duplicate{"", "part"},
        MergeLayers{"other", "part"},
        RemoveLayer{"third"},
        Select{by::Nothing{}},
        StateUnit{0.123},
        StateGround{glm::normalize(glm::dvec3(0.1, -1, 0.2))},
        StateGround{},
    };
}

TEST(EditScript, Every_edit_reads_back_to_the_same_text) {
    const std::vector<EditOperation> all = every_edit();
    std::vector<bool> used(std::variant_size_v<EditOperation>), ways(std::variant_size_v<Selector>);
    for (const EditOperation& one : all) {
        used[one.index()] = true;
        if (const auto* select = std::get_if<edits::Select>(&one))
            ways[select->what.index()] = true;
    }
    EXPECT_EQ(std::count(used.begin(), used.end(), false), 0) << "an operation is not tested";
    EXPECT_EQ(std::count(ways.begin(), ways.end(), false), 0) << "a selector is not tested";
    const fs::path folder = fs::absolute("folder");
    const std::string text = format_edit_script(all, folder);
    EXPECT_NE(text.find("\"other scene.ply\""), std::string::npos) << "relative to the script";
    const std::vector<EditOperation> again = parse_edit_script(text, "test", folder);
    ASSERT_EQ(again.size(), all.size());
    EXPECT_EQ(format_edit_script(again, folder), text);
}

TEST(EditScript, A_replay_of_what_was_recorded_gives_the_same_bits) {
    const SplatModel start = some_scene(1), other = some_scene(2, 30);
    const ReadScene read = [&](const fs::path&) { return other; };
    SplatModel first = start;
    Edit edit(first, "scene", "scene.ply");
    std::size_t steps = 0;
    for (const EditOperation& one : every_edit()) steps += edit.perform(one, first, read) > 0;
    EXPECT_GT(steps, 30u) << "too many edits change nothing for a test";
    const std::string script = format_edit_script(edit.operations(), ".");

    SplatModel second = start;
    Edit replayed(second, "scene", "scene.ply");
    for (const EditOperation& one : parse_edit_script(script, "test", "."))
        EXPECT_GT(replayed.perform(one, second, read), 0u) << replayed.last();
    expect_same(second, first);
    EXPECT_EQ(replayed.removed(), edit.removed());
    EXPECT_EQ(replayed.selected(), edit.selected());
    EXPECT_EQ(replayed.layers(), edit.layers());
    expect_same(replayed.apply(second), edit.apply(first));
    EXPECT_EQ(format_edit_script(replayed.operations(), "."), script);
}

TEST(EditScript, Masks_and_drags_of_a_window_are_recorded_too) {
    const SplatModel start = some_scene(3);
    SplatModel model = start;
    Edit edit(model, "scene", "");
    SplatSet mask(model.size(), 0);
    for (std::size_t i = 0; i < mask.size(); i += 3) mask[i] = 1;
    edit.select(mask, Combine::replace);
    edit.begin_transform(model);
    edit.drag_transform({1, glm::dmat3(1.0), {9, 9, 9}}, model);
    edit.drag_transform(a_move(), model);
    edit.end_transform(model);
    edit.remove(model, {Region::Shape::box, {0, 0, 0}, glm::dvec3(0.4)}, true);
    edit.hide_selected();
    edit.remove(mask);
    edit.undo(model);
    SplatModel second = start;
    Edit replayed(second, "scene", "");
    for (const EditOperation& one : edit.operations()) replayed.perform(one, second);
    expect_same(second, model);
    EXPECT_EQ(replayed.unseen(), edit.unseen());
    EXPECT_EQ(replayed.removed(), edit.removed());
}

TEST(EditScript, Undo_walks_back_to_the_scene_as_it_was_opened) {
    const SplatModel start = some_scene(1), other = some_scene(2, 30);
    SplatModel model = start;
    Edit edit(model, "scene", "");
    for (const EditOperation& one : every_edit())
        edit.perform(one, model, [&](const fs::path&) { return other; });
    const SplatModel after = model;
    while (edit.can_undo()) edit.undo(model);
    expect_same(model, start);
    EXPECT_EQ(edit.removed_count() + edit.hidden_count() + edit.selected_count(), 0u);
    EXPECT_EQ(edit.layers().size(), 1u);
    while (edit.can_redo()) edit.redo(model);
    expect_same(model, after);
}

struct Mistake {
    const char *text, *said;
};

TEST(EditScript, Mistakes_are_named_by_place_and_reason) {
    const Mistake mistakes[] = {
        {R"({"edits": []})", "darb_edits"},
        {R"({"darb_edits": 2, "edits": []})", "is not 1"},
        {R"({"darb_edits": 1, "edit": []})", "unknown key 'edit'"},
        {R"({"darb_edits": 1, "edits": {}})", "is not a list"},
        {R"({"darb_edits": 1, "edits": [{"op": "explode"}]})", "edits[0]: op: is 'explode'"},
        {R"({"darb_edits": 1, "edits": [{"op": "invert"}, {"op": "select", "by": "taste"}]})",
         "edits[1]: by: is 'taste'"},
        {R"({"darb_edits": 1, "edits": [{"op": "delete", "by": "opacity", "low": 0, "high": 2}]})",
         "high: is 2; 0 to 1 can be"},
        {R"({"darb_edits": 1, "edits": [{"op": "delete", "by": "sphere", "centre": [0, 0],
             "radius": 1}]})",
         "centre: is not a list of 3 numbers"},
        {R"({"darb_edits": 1, "edits": [{"op": "invert", "by": "layer"}]})", "unknown key 'by'"},
        {R"({"darb_edits": 1, "edits": [{"op": "transform", "scale": 0}]})", "scale"},
        {R"({"darb_edits": 1, "edits": [{"op": "transform",
             "turn": [[1, 0, 0], [0, 2, 0], [0, 0, 1]]}]})",
         "is no rotation"},
        {R"({"darb_edits": 1, "edits": [{"op": "select", "by": "numbers", "ranges": [[0, -1]]}]})",
         "not the number of a splat"},
        {R"({"darb_edits": 1, "edits": [{"op": "add", "file": ""}]})", "file: is empty"},
    };
    for (const Mistake& mistake : mistakes) try {
            parse_edit_script(mistake.text, "script", ".");
            ADD_FAILURE() << mistake.text;
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(mistake.said), std::string::npos) << e.what();
        }
}

TEST(EditScript, What_cannot_be_done_changes_nothing) {
    SplatModel model = some_scene(4);
    const SplatModel before = model;
    Edit edit(model, "scene", "");
    const std::vector<EditOperation> wrong{edits::Select{by::Numbers{{{70, 11}}}},
                                           edits::Select{by::Layer{"none"}},
                                           edits::Transform{{}, "none"},
                                           edits::RemoveLayer{"scene"},
                                           edits::Add{"a.ply", ""},
                                           edits::MergeLayers{"scene", "none"},
                                           edits::RenameLayer{"scene", ""},
                                           edits::Transform{{-1, glm::dmat3(1.0), {}}, ""}};
    for (const EditOperation& one : wrong)
        EXPECT_THROW(edit.perform(one, model), Error) << one.index();
    EXPECT_FALSE(edit.can_undo() || edit.transforms());
    expect_same(model, before);
}

TEST(EditScript, Selectors_of_the_command_line) {
    const auto region = std::get<Region>(selector_from_text("--keep", "box:-1,-2,-3,1,2,5"));
    EXPECT_EQ(region.centre, glm::dvec3(0, 0, 1));
    EXPECT_EQ(region.half_size, glm::dvec3(1, 2, 4));
    EXPECT_EQ(std::get<by::Opacity>(selector_from_text("--keep", "opacity:0.5,1")).low, 0.5);
    EXPECT_EQ(std::get<by::Layer>(selector_from_text("--keep", "layer:a:b")).name, "a:b");
    for (const char* wrong :
         {"", "sphere", "sphere:", "sphere:1,2,3", "sphere:0,0,0,-1", "opacity:0,2", "cube:1",
          "haze:0.1", "size:1,,2", "opacity:0,nan", "box:1,2,3,4,5,6,7"})
        EXPECT_THROW(selector_from_text("--keep", wrong), Error) << wrong;
}

}  // namespace
}  // namespace darb::test
