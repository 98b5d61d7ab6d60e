// SPDX-License-Identifier: MIT
// darb edit and projects on the command line, as a user runs them.
#include <gtest/gtest.h>

#include "engine/core/files.h"
#include "engine/scene/edit.h"
#include "engine/scene/edit_script.h"
#include "engine/scene/ply.h"
#include "engine/scene/project_file.h"
#include "engine/scene/splat_file.h"
#include "tests/support/run_command.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

// The folder with a.ply, b.ply, a script and a project that does the same.
struct EditCase {
    EditCase() {
        write_ply(folder / "a.ply", random_scene({.count = 50, .seed = 1}).model);
        write_ply(folder / "b.ply", random_scene({.count = 30, .seed = 2}).model);
        edits = {edits::Select{Region{Region::Shape::sphere, {0, 0, 0}, glm::dvec3(0.8)}},
                 edits::Transform{{1.5, turn_of_degrees({10, 0, 40}), {0, 0, 1}}, ""},
                 edits::Add{folder / "b.ply", "b"},
                 edits::Transform{{0.5, glm::dmat3(1.0), {2, 0, 0}}, "b"},
                 edits::Remove{by::Opacity{0, 0.35}, false}};
        write_edit_script(folder / "edits.json", edits);
        EditedScene scene;
        scene.model = load_splats(folder / "a.ply");
        scene.edit = Edit(scene.model, "a", folder / "a.ply");
        for (const EditOperation& one : edits)
            scene.edit.perform(one, scene.model,
                               [](const fs::path& file) { return load_splats(file); });
        save_splats(folder / "wanted.ply", SplatFormat::ply, scene.saved());
        wanted = read_file(folder / "wanted.ply");
        write_project(folder / "room.darb.json", project_of(scene.edit, folder / "a.ply", "a"));
    }
    std::string file(const char* name) const { return "'" + (folder / name).string() + "'"; }
    fs::path folder = scratch();
    std::vector<EditOperation> edits;
    std::vector<std::byte> wanted;
};

TEST(EditCommand, Repeats_a_script_bit_by_bit_and_records_it) {
    const EditCase c;
    const Outcome o =
        darb(fmt::format("edit {} --script {} -o {} --record {}", c.file("a.ply"),
                         c.file("edits.json"), c.file("out.ply"), c.file("again.json")));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(read_file(c.folder / "out.ply"), c.wanted);
    EXPECT_EQ(read_text_file(c.folder / "again.json"), read_text_file(c.folder / "edits.json"));
    EXPECT_NE(o.out.find("merged 30 splats"), std::string::npos) << o.out;
}

TEST(EditCommand, Options_select_delete_and_move) {
    const EditCase c;
    const Outcome o = darb(fmt::format(
        "edit {} --add {} --keep sphere:0,0,0,0.9 --keep layer:b --delete opacity:0,0.35 --scale 2 "
        "--about 1,0,0 -o {} -q",
        c.file("a.ply"), c.file("b.ply"), c.file("options.ply")));
    ASSERT_EQ(o.code, 0) << o.err;
    SplatModel wanted = load_splats(c.folder / "a.ply");
    keep_splats(
        [&](std::size_t i) {
            return glm::length(position_of(wanted, i)) <= 0.9 &&
                   sigmoid(double{wanted.opacity_logit[i]}) > 0.35;
        },
        wanted);
    const SplatModel got = load_splats(c.folder / "options.ply");
    ASSERT_GT(got.size(), wanted.size());
    EXPECT_NEAR(position_of(got, 0).x, 2 * position_of(wanted, 0).x - 1, 1e-6);
    EXPECT_EQ(o.out, (c.folder / "options.ply").string() + "\n");
}

TEST(EditCommand, A_project_is_a_scene_for_other_commands) {
    const EditCase c;
    Outcome o = darb(fmt::format("convert {} -o {} --no-measure", c.file("room.darb.json"),
                                 c.file("converted.ply")));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(read_file(c.folder / "converted.ply"), c.wanted);
    o = darb(fmt::format("info {} --json {}", c.file("room.darb.json"), c.file("info.json")));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(read_json(c.folder / "info.json")["splats"],
              load_splats(c.folder / "wanted.ply").size());
    o = darb(fmt::format("edit {} --layer b -o {}", c.file("room.darb.json"), c.file("b2.ply")));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_LE(load_splats(c.folder / "b2.ply").size(), 30u);
    write_ply(c.folder / "b.ply", random_scene({.count = 30, .seed = 3}).model);
    o = darb(fmt::format("info {}", c.file("room.darb.json")));
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.err.find("b.ply has changed"), std::string::npos) << o.err;
}

TEST(EditCommand, A_project_is_rendered_like_the_scene_it_stands_for) {
    const EditCase c;
    for (const char* scene : {"room.darb.json", "wanted.ply"}) {
        const Outcome o = darb(
            fmt::format("render {} --size 64x48 --seconds 0.1 --fps 10 -o '{}' -q", c.file(scene),
                        (c.folder / (std::string(scene) + "_frames")).string()));
        ASSERT_EQ(o.code, 0) << o.err;
    }
    EXPECT_EQ(read_file(c.folder / "room.darb.json_frames/frame_00000.png"),
              read_file(c.folder / "wanted.ply_frames/frame_00000.png"));
}

TEST(EditCommand, Mistakes_are_refused_and_nothing_is_written) {
    const EditCase c;
    write_file_atomic(c.folder / "wrong.json", R"({"darb_edits": 1, "edits": [{"op": "fly"}]})");
    write_file_atomic(c.folder / "far.json",
                      R"({"darb_edits": 1, "edits": [{"op": "delete_layer", "layer": "x"}]})");
    write_file_atomic(c.folder / "lost.darb.json",
                      R"({"darb_project": 1, "layers": [{"file": "none.ply"}]})");
    const std::string out = " -o " + c.file("never.ply"), a = "edit " + c.file("a.ply");
    expect_refused(
        {{a + out, "names no edits"},
         {a + " --script " + c.file("wrong.json") + out, "edits[0]: op: is 'fly'"},
         {a + " --script " + c.file("far.json") + out, "layer 'x'"},
         {a + " --keep cube:1" + out, "--keep cube:1"},
         {a + " --delete all" + out, "nothing would be left"},
         {a + " --delete all -o " + c.file("a.ply"), "is what is read"},
         {a + " --layer none" + out, "There are: a."},
         {"edit " + c.file("lost.darb.json") + " --delete all" + out, "none.ply"},
         {"convert " + c.file("room.darb.json") + " " + c.file("b.ply"), "is what is read"}});
    EXPECT_FALSE(fs::exists(c.folder / "never.ply"));
}

}  // namespace
}  // namespace darb::test
