// SPDX-License-Identifier: MIT
// Layers of an edit: what is hidden, moved, copied, merged and saved, and kernels that differ.
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/scene/dot_splat.h"
#include "engine/scene/edit.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

constexpr std::size_t kFirst = 20, kSecond = 10;

SplatModel layer_scene(std::uint64_t seed, std::size_t count, int kernel = KERNEL_GAUSSIAN) {
    SceneOptions options;
    options.count = count;
    options.seed = seed;
    SplatModel model = random_scene(options).model;
    set_kernel(model, kernel);
    return model;
}

// Two layers, "a" of 20 splats and "b" of 10.
struct TwoLayers {
    explicit TwoLayers(int kernel = KERNEL_GAUSSIAN)
        : model(layer_scene(1, kFirst)), second(layer_scene(2, kSecond, kernel)) {
        first = model;
        edit = Edit(model, "a", "a.ply");
        edit.merge(second, model, {"b.ply", "b"});
    }
    std::size_t perform(const EditOperation& operation) { return edit.perform(operation, model); }
    SplatModel first, model, second;
    Edit edit;
};

void expect_values(const SplatModel& a, const SplatModel& b) {
    EXPECT_EQ(a.kernel, b.kernel);
    for (int attribute = 0; attribute < kAttributeCount; ++attribute)
        EXPECT_EQ(attribute_values(a, attribute), attribute_values(b, attribute)) << attribute;
}

TEST(EditLayers, A_hidden_layer_is_neither_seen_nor_selected_nor_deleted_nor_saved) {
    TwoLayers two;
    EXPECT_EQ(two.edit.selected_count(), kSecond) << "what was added is selected";
    two.perform(edits::ShowLayer{"b", false});
    EXPECT_EQ(two.edit.selected_count(), 0u);
    EXPECT_EQ(count_of(two.edit.unseen()), kSecond);
    EXPECT_EQ(two.perform(edits::Select{by::Everything{}}), kFirst);
    expect_values(two.edit.apply(two.model), two.first);
    EXPECT_EQ(two.perform(edits::Remove{by::Everything{}, false}), kFirst);
    two.perform(edits::ShowLayer{"b", true});
    expect_values(two.edit.apply(two.model), two.second);
    EXPECT_TRUE(two.edit.unsaved());
}

TEST(EditLayers, Are_saved_in_the_order_of_the_list_or_one_alone) {
    TwoLayers two;
    two.perform(edits::PlaceLayer{"b", 0});
    const SplatModel all = two.edit.apply(two.model);
    ASSERT_EQ(all.size(), kFirst + kSecond);
    EXPECT_EQ(all.opacity_logit[0], two.second.opacity_logit[0]);
    EXPECT_EQ(all.opacity_logit[kSecond], two.first.opacity_logit[0]);
    two.perform(edits::ShowLayer{"a", false});
    expect_values(two.edit.apply(two.model, two.edit.layers()[1]), two.first);
}

TEST(EditLayers, A_layer_knows_how_it_was_moved_as_a_whole) {
    TwoLayers two;
    const Similarity move{2, turn_of_degrees({0, 0, 90}), {1, 2, 3}};
    EXPECT_EQ(two.perform(edits::Transform{move, "b"}), kSecond);
    two.perform(edits::Transform{move, ""});  // the selection, which is that layer
    EXPECT_EQ(two.edit.layers()[0].moved, Similarity{});
    EXPECT_EQ(two.edit.layers()[1].moved, followed_by(move, move));
    two.perform(edits::Select{by::Numbers{{{static_cast<std::uint32_t>(kFirst), 1}}}});
    two.perform(edits::Transform{move, ""});
    EXPECT_EQ(two.edit.layers()[1].moved, followed_by(move, move)) << "only a part moved";
    const Similarity home =
        followed_by(two.edit.layers()[1].moved, inverse(followed_by(move, move)));
    EXPECT_NEAR(home.scale, 1, 1e-12);
    EXPECT_NEAR(glm::length(home.translation), 0, 1e-12);
    two.edit.undo(two.model);
    two.edit.undo(two.model);
    two.edit.undo(two.model);
    two.edit.undo(two.model);
    EXPECT_EQ(two.edit.layers()[1].moved, Similarity{});
    expect_values(two.edit.apply(two.model, two.edit.layers()[1]), two.second);
}

TEST(EditLayers, Copies_merges_and_deletions_can_be_undone) {
    TwoLayers two;
    EXPECT_EQ(two.perform(edits::Duplicate{"b", ""}), kSecond);
    EXPECT_EQ(two.edit.layers()[2].name, "b copy");
    EXPECT_EQ(two.edit.selected_count(), kSecond);
    two.perform(edits::MergeLayers{"a", "b copy"});
    ASSERT_EQ(two.edit.layers().size(), 2u);
    EXPECT_EQ(two.edit.count_in(two.edit.layers()[0]), kFirst + kSecond);
    two.perform(edits::RemoveLayer{"a"});
    expect_values(two.edit.apply(two.model), two.second);
    EXPECT_EQ(two.edit.undo(two.model), "deleted the layer a");
    EXPECT_EQ(two.edit.undo(two.model), "merged the layer b copy into a");
    EXPECT_EQ(two.edit.undo(two.model), "copied 10 splats");
    EXPECT_EQ(two.model.size(), kFirst + kSecond);
    EXPECT_EQ(two.edit.layers().size(), 2u);
}

TEST(EditLayers, Names_stay_different) {
    TwoLayers two;
    two.edit.merge(two.second, two.model, {"b.ply", "b"});
    EXPECT_EQ(two.edit.layers()[2].name, "b 2");
    two.perform(edits::RenameLayer{"b 2", "a"});
    EXPECT_EQ(two.edit.layers()[2].name, "a 2");
}

// One picture has one kernel, so layers that differ are drawn and saved together as Gaussians; each
// keeps its own values.
TEST(EditLayers, Different_kernels_become_gaussians_where_they_are_together) {
    TwoLayers two(KERNEL_RAISED_COSINE);
    EXPECT_TRUE(two.edit.mixes_kernels());
    EXPECT_EQ(two.edit.losses_together().size(), 1u);
    const SplatModel gaussians = as_gaussians(two.second, false);
    const std::optional<SplatModel> drawn = two.edit.drawn_otherwise(two.model);
    ASSERT_TRUE(drawn);
    EXPECT_EQ(drawn->kernel, KERNEL_GAUSSIAN);
    EXPECT_EQ(drawn->log_scale[3 * kFirst], gaussians.log_scale[0]);
    EXPECT_NE(drawn->log_scale[3 * kFirst], two.second.log_scale[0]);
    EXPECT_EQ(two.edit.apply(two.model).log_scale, drawn->log_scale);
    expect_values(two.edit.apply(two.model, two.edit.layers()[1]), two.second);
    EXPECT_THROW(two.perform(edits::MergeLayers{"a", "b"}), Error);
    two.perform(edits::ShowLayer{"a", false});
    EXPECT_EQ(two.model.kernel, KERNEL_RAISED_COSINE) << "alone it is drawn as it is";
    EXPECT_FALSE(two.edit.drawn_otherwise(two.model));
    expect_values(two.edit.apply(two.model), two.second);
    two.edit.undo(two.model);
    two.edit.undo(two.model);
    expect_values(two.model, two.first);
}

TEST(EditLayers, Shapes_come_and_go_with_the_layer_that_has_them) {
    TwoLayers two(KERNEL_GENERALIZED_EXPONENTIAL);
    if (two.second.shape.empty()) GTEST_SKIP() << "the kernel takes no shapes";
    EXPECT_EQ(two.model.shape.size(), kFirst + kSecond);
    EXPECT_TRUE(two.edit.apply(two.model).shape.empty());
    EXPECT_EQ(two.edit.apply(two.model, two.edit.layers()[1]).shape.size(), kSecond);
    two.perform(edits::ShowLayer{"b", false});
    ASSERT_TRUE(two.edit.drawn_otherwise(two.model));
    EXPECT_TRUE(two.edit.drawn_otherwise(two.model)->shape.empty());
    two.edit.undo(two.model);
    two.edit.undo(two.model);
    EXPECT_TRUE(two.model.shape.empty());
}

TEST(EditLayers, The_unit_and_the_place_are_those_of_the_first_scene) {
    SplatModel model = layer_scene(1, kFirst), second = layer_scene(2, kSecond);
    model.metres_per_unit = 0.5;
    model.place.rotation = glm::dmat3(1.0);
    second.metres_per_unit = 3;
    const EarthPlace place = model.place;
    Edit edit(model, "a", "");
    edit.merge(second, model, {"", "b"});
    edit.perform(edits::Transform{{2, glm::dmat3(1.0), {1, 0, 0}}, "b"}, model);
    EXPECT_EQ(edit.apply(model).metres_per_unit, 0.5);
    EXPECT_EQ(edit.apply(model).place, place);
    EXPECT_EQ(edit.apply(model, edit.layers()[1]).metres_per_unit, 0.5);
}

}  // namespace
}  // namespace darb::test
