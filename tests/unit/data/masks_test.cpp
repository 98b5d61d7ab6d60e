// SPDX-License-Identifier: MIT
// Masks beside the photos of COLMAP models and transforms files, under every name that is used.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/core/files.h"
#include "engine/data/camera_list.h"
#include "engine/data/colmap.h"
#include "engine/data/image_io.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

/// Photos left/a.JPG (a PNG on disk) and b.png, with a COLMAP model or a transforms file.
fs::path write_masked_set(bool colmap) {
    const fs::path folder = test_folder();
    std::vector<View> views(2);
    views[0].name = "left/a.JPG";
    views[1].name = "b.png";
    std::string frames;
    for (View& view : views) {
        view.camera = {.width = 8, .height = 6, .fx = 20, .fy = 20, .cx = 4, .cy = 3};
        write_png(folder / "images" / view.name, ImageU8(8, 6, 3));
        frames += (frames.empty() ? "" : ",") + std::string(R"({"file_path": "images/)") +
                  view.name +
                  R"(", "transform_matrix": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]})";
    }
    if (colmap)
        write_colmap_binary(folder / "sparse/0", views, {});
    else
        write_file_atomic(folder / "transforms.json",
                          R"({"fl_x": 10, "frames": [)" + frames + "]}");
    return folder;
}

class Masks : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Sources, Masks, testing::Bool(),
                         [](const auto& test) { return test.param ? "colmap" : "transforms"; });

TEST_P(Masks, are_found_by_every_usual_name) {
    const fs::path set = write_masked_set(GetParam());
    for (const char* folder : {"masks", "mask"})
        for (const char* stem : {"left/a.JPG", "left/a"})
            for (const char* tail : {"", ".mask"})
                for (const char* extension : {".png", ".jpg", ".PNG", ".JPEG"}) {
                    for (const char* old : {"masks", "mask"}) fs::remove_all(set / old);
                    fs::create_directories(set / "masks");  // an empty one hides none
                    const fs::path mask = set / folder / (std::string(stem) + tail + extension);
                    write_png(mask, ImageU8(8, 6, 1));
                    const Dataset dataset = load_dataset(set);
                    const bool first = dataset.views.at(0).name.ends_with("a.JPG");
                    EXPECT_EQ(dataset.views.at(first ? 0 : 1).mask, mask);
                    EXPECT_TRUE(dataset.alpha_is_mask) << mask;
                    EXPECT_TRUE(std::ranges::any_of(dataset.notes, [](const std::string& note) {
                        return note.find("1 of 2 photos have none") != std::string::npos;
                    }));
                }
}

TEST_P(Masks, of_which_none_is_a_photos_are_an_error_that_names_the_form) {
    const fs::path set = write_masked_set(GetParam());
    fs::create_directories(set / "masks");
    write_file_atomic(set / "masks/.hidden", std::string("x"));
    write_file_atomic(set / "masks/README", std::string("x"));
    EXPECT_NO_THROW(load_dataset(set));
    write_png(set / "masks/deep/0001.png", ImageU8(8, 6, 1));
    const std::string error = error_of([&] { load_dataset(set); });
    EXPECT_EQ(error.find((set / "masks").string()), 0u) << error;
    for (const char* part : {"for any of the 2 photos", "left/a.png for left/a.JPG", "remove the"})
        EXPECT_NE(error.find(part), std::string::npos) << error;
    EXPECT_NO_THROW(load_cameras(set)) << "cameras need no masks";
}

TEST_P(Masks, of_near_names_are_found_where_there_is_no_doubt) {
    for (const char* name :
         {"Masks/left/a.png", "MASK/left/a.JPG.png", "masks/left/a_mask.png",
          "masks/left/a.png.png", "masks/left/A.jpg.PNG", "masks/a.png", "masks/left/mask_a.png",
          "masks/cam/left/a.png", "images/left/a_mask.png", "images/left/a.JPG.mask.png",
          "images/left/a-mask.jpg"}) {
        const fs::path set = write_masked_set(GetParam());
        write_png(set / name, ImageU8(8, 6, 1));
        const Dataset dataset = load_dataset(set);
        const bool first = dataset.views.at(0).name.ends_with("a.JPG");
        EXPECT_EQ(dataset.views.at(first ? 0 : 1).mask, set / name);
        EXPECT_TRUE(dataset.views.at(first ? 1 : 0).mask.empty()) << name;
    }
    const fs::path set = write_masked_set(GetParam());
    write_png(set / "masks/right/a.png", ImageU8(8, 6, 1));
    EXPECT_NE(error_of([&] { load_dataset(set); }).find("for any of the 2"), std::string::npos)
        << "another camera's";
}

TEST_P(Masks, in_folders_that_may_have_been_meant_are_noted) {
    for (const char* name : {"segmentation/b.png", "dynamic_mask/b.png", "masks_2/b.npy"}) {
        const fs::path set = write_masked_set(GetParam());
        write_png(set / name, ImageU8(8, 6, 1));
        const Dataset dataset = load_dataset(set);
        EXPECT_FALSE(dataset.alpha_is_mask);
        ASSERT_EQ(dataset.notes.size(), 1u) << name;
        EXPECT_NE(dataset.notes[0].find(fs::path(name).parent_path().string()), std::string::npos)
            << dataset.notes[0];
    }
}

TEST(MasksOfTransforms, that_frames_name_are_all_there_are) {
    const fs::path set = write_masked_set(false);
    std::string text = read_text_file(set / "transforms.json");
    text.insert(text.find("\"transform_matrix\""), R"("mask_path": "mine.png", )");
    write_file_atomic(set / "transforms.json", text);
    write_png(set / "mine.png", ImageU8(8, 6, 1));
    write_png(set / "masks/b.png", ImageU8(8, 6, 1));
    const Dataset dataset = load_dataset(set);
    EXPECT_TRUE(dataset.views.at(0).mask.empty()) << dataset.views[0].name;
    EXPECT_EQ(dataset.views.at(1).mask, set / "mine.png");
}

}  // namespace
}  // namespace darb
