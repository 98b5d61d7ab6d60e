// SPDX-License-Identifier: MIT
// Projects: what is written reads back, files that changed are noticed, mistakes are named, and the
// splats are those of the window that saved it.
#include "engine/scene/project_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/scene/ply.h"
#include "engine/scene/splat_file.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

SplatModel model_of_seed(std::uint64_t seed, std::size_t count) {
    SceneOptions options;
    options.count = count;
    options.seed = seed;
    return random_scene(options).model;
}

// Three scenes in a folder.
class ProjectFileTest : public ::testing::Test {
  protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("darb_project_" + std::to_string(::getpid()));
        fs::create_directories(folder_ / "parts");
        for (int n = 0; n < 3; ++n) write_ply(file(n), model_of_seed(n + 1, 20));
        project_ = folder_ / "room.darb.json";
    }
    void TearDown() override { fs::remove_all(folder_); }
    fs::path file(int n) const { return folder_ / "parts" / ("part" + std::to_string(n) + ".ply"); }
    static SplatModel read(const fs::path& file) { return load_splats(file); }

    // As a window leaves it: b is added first, c after an edit.
    EditedScene edited() const {
        EditedScene scene;
        scene.model = read(file(0));
        scene.edit = Edit(scene.model, "a", file(0));
        const std::vector<EditOperation> steps{
            edits::Add{file(1), "b"},
            edits::Transform{{1.5, turn_of_degrees({1, 2, 3}), {0.1, 0, 0}}, "b"},
            edits::Remove{Region{Region::Shape::sphere, {0, 0, 0}, glm::dvec3(0.5)}, false},
            edits::Add{file(2), "c"},
            edits::ShowLayer{"a", false},
            edits::StateUnit{0.25}};
        for (const EditOperation& step : steps)
            EXPECT_GT(scene.edit.perform(step, scene.model, read), 0u);
        scene.edit.note_measured(
            {{{0, 0, 0}, {1, 0, 1.0 / 3}}, false},
            {{{1, 2, 3}, "chair", "of wood\n\"old\"", NoteCamera{{1, 1, 1}, {1, 0, 0, 0}, 0.9}},
             {{0, 0, 0}, "floor", "", {}}});
        return scene;
    }
    Project whole() const {
        const EditedScene scene = edited();
        Project project = project_of(scene.edit, file(0), "a");
        project.cameras = folder_ / "cameras.json";
        project.path = {{0, {{0, 0, 1}, {1, 0, 0, 0}, 1}}, {2.5, {{1, 0, 1}, {0, 1, 0, 0}, 1}}};
        project.view = ProjectView{{{3, 2, 1}, {0, 0, 1, 0}, 0.8}, 4, {0, 0, 1}, {0.1, 0.2, 0.3}};
        return project;
    }
    fs::path folder_, project_;
};

TEST_F(ProjectFileTest, Reads_back_to_the_same_text_with_names_relative_to_it) {
    const std::string text = format_project(whole(), folder_);
    EXPECT_EQ(text.find(folder_.string()), std::string::npos) << text;
    EXPECT_NE(text.find("\"parts/part2.ply\""), std::string::npos) << text;
    const Project again = parse_project(text, "test", folder_);
    EXPECT_EQ(again.layers.size(), 2u) << "what was added first of all is a layer";
    EXPECT_EQ(again.files.size(), 3u);
    EXPECT_EQ(again.notes.size(), 2u);
    EXPECT_EQ(format_project(again, folder_), text);
}

TEST_F(ProjectFileTest, Opens_to_the_same_bits_wherever_the_folder_is_moved) {
    const EditedScene before = edited();
    write_project(project_, project_of(before.edit, file(0), "a"));
    const fs::path moved = folder_.string() + "_moved";
    fs::rename(folder_, moved);
    const Project project = read_project(moved / "room.darb.json");
    EXPECT_TRUE(changed_files(project, "test").empty());
    const EditedScene after = perform_project(project, "test", read);
    fs::rename(moved, folder_);
    const SplatModel a = before.saved(), b = after.saved();
    for (int attribute = 0; attribute < kAttributeCount; ++attribute)
        EXPECT_EQ(attribute_values(a, attribute), attribute_values(b, attribute)) << attribute;
    EXPECT_EQ(b.metres_per_unit, 0.25);
    EXPECT_EQ(after.edit.facts(), before.edit.facts());
    ASSERT_EQ(after.edit.layers().size(), 3u);
    EXPECT_FALSE(after.edit.layers()[0].visible);
    EXPECT_EQ(after.edit.layers()[1].moved, before.edit.layers()[1].moved);
    EXPECT_TRUE(after.edit.can_undo()) << "the history is there again";
}

TEST_F(ProjectFileTest, A_file_that_changed_or_is_missing_is_named) {
    write_project(project_, whole());
    const Project project = read_project(project_);
    write_file_atomic(folder_ / "cameras.json", "[]");
    EXPECT_TRUE(changed_files(project, "test").empty());
    std::vector<std::byte> bytes = read_file(file(1));
    bytes.back() ^= std::byte{1};  // as many bytes as before
    write_file_atomic(file(1), bytes);
    const std::vector<std::string> said = changed_files(project, "test");
    ASSERT_EQ(said.size(), 1u);
    EXPECT_NE(said[0].find("part1.ply has changed"), std::string::npos) << said[0];
    fs::remove(file(2));
    try {
        changed_files(project, "room");
        ADD_FAILURE();
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("part2.ply"), std::string::npos) << e.what();
    }
}

TEST_F(ProjectFileTest, Layers_written_by_hand_are_moved_and_hidden) {
    const char* text = R"({"darb_project": 1, "layers": [
        {"file": "parts/part0.ply", "visible": false},
        {"file": "parts/part1.ply", "name": "b",
         "transform": {"degrees": [0, 90, 0], "about": [1, 0, 0], "scale": 2}}]})";
    const EditedScene scene = perform_project(parse_project(text, "test", folder_), "test", read);
    EXPECT_EQ(scene.edit.layers()[0].name, "part0");
    const SplatModel saved = scene.saved(), second = read(file(1));
    ASSERT_EQ(saved.size(), second.size());
    const glm::dvec3 p = position_of(second, 0) - glm::dvec3(1, 0, 0);
    const glm::dvec3 wanted = glm::dvec3(1, 0, 0) + 2.0 * glm::dvec3(p.z, p.y, -p.x);
    EXPECT_NEAR(glm::distance(position_of(saved, 0), wanted), 0, 1e-6);
}

TEST_F(ProjectFileTest, Mistakes_are_named_by_place_and_reason) {
    const std::pair<const char*, const char*> mistakes[] = {
        {R"({"layers": [{"file": "a.ply"}]})", "darb_project"},
        {R"({"darb_project": 2, "layers": [{"file": "a.ply"}]})", "is not 1"},
        {R"({"darb_project": 1, "layers": []})", "has no layers"},
        {R"({"darb_project": 1, "layers": [{"name": "a"}]})", "layers[0]: lacks 'file'"},
        {R"({"darb_project": 1, "layers": [{"file": "a.ply", "colour": 1}]})", "'colour'"},
        {R"({"darb_project": 1, "layers": [{"file": "a.ply"}], "notes": [{"at": [0, 0]}]})",
         "notes[0]: at"},
        {R"({"darb_project": 1, "layers": [{"file": "a.ply"}], "edits": [{"op": "fly"}]})",
         "edits[0]: op"},
        {R"({"darb_project": 1, "layers": [{"file": "a.ply"}], "path": [
            {"seconds": 1, "eye": [0, 0, 0], "orientation": [1, 0, 0, 0], "fov_y_degrees": 50},
            {"seconds": 1, "eye": [0, 0, 0], "orientation": [1, 0, 0, 0], "fov_y_degrees": 50}]})",
         "path[1]: seconds"},
        {R"({"darb_project": 1, "layers": [{"file": "a.ply"}],
            "measurement": {"points": [[0, 0, 0]], "closed": true}})",
         "closed"},
    };
    for (const auto& mistake : mistakes) try {
            parse_project(mistake.first, "room", folder_);
            ADD_FAILURE() << mistake.first;
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(mistake.second), std::string::npos) << e.what();
        }
    const Project wrong = parse_project(
        R"({"darb_project": 1, "layers": [{"file": "parts/part0.ply"}],
            "edits": [{"op": "invert"}, {"op": "delete_layer", "layer": "x"}]})",
        "room", folder_);
    try {
        perform_project(wrong, "room", read);
        ADD_FAILURE();
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("room: edits[1]: layer 'x'"), std::string::npos)
            << e.what();
    }
}

TEST(ProjectFile, Is_told_by_its_name) {
    EXPECT_TRUE(is_project_file("a/Room.DARB.json"));
    EXPECT_FALSE(is_project_file("a/cameras.json"));
    EXPECT_FALSE(is_project_file("room.darb"));
}

}  // namespace
}  // namespace darb::test
