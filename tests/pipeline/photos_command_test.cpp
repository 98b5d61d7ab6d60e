// SPDX-License-Identifier: MIT
// darb train on photos without cameras: what it says without COLMAP, and how it calls it.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "engine/core/files.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "tests/support/fake_programs.h"
#include "tests/support/run_command.h"

namespace darb {
namespace {

using namespace test;

using test::kScene;

// Photos without cameras, and a program named colmap that notes its calls and takes the scene's own
// model as its result.
class PhotosCommand : public testing::Test {
  protected:
    void SetUp() override {
        fs::remove_all(scratch());  // left by the case before
        for (const char* name : {"view_00.png", "view_01.png", "view_02.png"}) {
            fs::create_directories(photos());
            fs::copy_file(kScene + "/images/" + name, photos() / name,
                          fs::copy_options::overwrite_existing);
        }
        write_fake_colmap(scratch() / "bin" / "colmap", calls(), kScene);
    }
    static fs::path photos() { return scratch() / "photos"; }
    static fs::path calls() { return scratch() / "calls"; }
    static std::string train() {
        return fmt::format("train {} -o {} --iterations 1 -q", photos().string(),
                           (scratch() / "from_photos").string());
    }
};

TEST_F(PhotosCommand, without_colmap_the_commands_are_shown) {
    const Outcome o = with_path("/nowhere", train());
    EXPECT_EQ(o.code, 2);
    for (const char* part : {"apt install colmap", "feature_extractor", "exhaustive_matcher",
                             "mapper", "image_undistorter"})
        EXPECT_NE(o.err.find(part), std::string::npos) << part << " in\n" << o.err;
    EXPECT_NE(with_path("/nowhere", train() + " --sequential").err.find("sequential_matcher"),
              std::string::npos);
}

TEST_F(PhotosCommand, colmap_runs_once_for_the_same_photos) {
    const std::string path = (scratch() / "bin").string() + ":/usr/bin:/bin";
    const Outcome first = with_path(path, train() + " --sequential");
    ASSERT_EQ(first.code, 0) << first.err;
    // The first calls ask for the names of options.
    const std::string all =
        "feature_extractor\nsequential_matcher\nfeature_extractor\nsequential_matcher\nmapper\n"
        "image_undistorter\n";
    EXPECT_EQ(read_text_file(calls()), all);
    EXPECT_EQ(with_path(path, train()).code, 0);
    EXPECT_EQ(
        with_path("/nowhere", "train --resume -o " + (scratch() / "from_photos").string()).code, 0);
    EXPECT_EQ(read_text_file(calls()), all);
    fs::copy_file(photos() / "view_00.png", photos() / "view_03.png");
    const Outcome other = with_path(path, train());
    EXPECT_EQ(other.code, 2);
    EXPECT_NE(other.err.find("other photos"), std::string::npos) << other.err;
}

TEST_F(PhotosCommand, preview_compares_neighbours_where_many_photos_follow_each_other) {
    const std::string path = (scratch() / "bin").string() + ":/usr/bin:/bin";
    const auto preview = [&](const std::string& output, const std::string& preset = "preview") {
        return with_path(path,
                         fmt::format("train {} -o {} --preset {} --iterations 1", photos().string(),
                                     (scratch() / output).string(), preset));
    };
    const Outcome few = preview("few");
    EXPECT_EQ(few.code, 0) << few.err;
    EXPECT_NE(few.err.find("all 3 pairs, as 3 photos are few"), std::string::npos) << few.err;
    for (int i = 3; i < 49; ++i)
        fs::copy_file(photos() / "view_00.png", photos() / fmt::format("view_{:02}.png", i));
    fs::remove(calls());
    const Outcome many = preview("many");
    EXPECT_NE(many.err.find("the numbers in their names"), std::string::npos) << many.err;
    const std::string called = read_text_file(calls());
    EXPECT_NE(called.find("sequential_matcher"), std::string::npos) << called;
    EXPECT_NE(many.err.find("Not found were those of view_48.png"), std::string::npos) << many.err;
    // The next preset takes these cameras, and says so.
    const Outcome good = preview("many", "good");
    EXPECT_EQ(good.code, 0) << good.err;
    EXPECT_EQ(read_text_file(calls()), called);
    EXPECT_NE(good.err.find("those of a run with --preset preview"), std::string::npos) << good.err;
    fs::rename(photos() / "view_48.png", photos() / "another.png");
    fs::remove(calls());
    const Outcome mixed = preview("mixed");
    EXPECT_NE(mixed.err.find("neither the times"), std::string::npos) << mixed.err;
    EXPECT_EQ(read_text_file(calls()).find("sequential"), std::string::npos);
}

TEST_F(PhotosCommand, another_size_straightens_again_and_keeps_the_cameras) {
    const std::string path = (scratch() / "bin").string() + ":/usr/bin:/bin";
    ASSERT_EQ(with_path(path, train()).code, 0);
    fs::remove(calls());
    ASSERT_EQ(with_path(path, train() + " -r 64").code, 0);
    EXPECT_EQ(read_text_file(calls()), "image_undistorter\n");
    ASSERT_EQ(with_path(path, train()).code, 0) << "these are large enough";
    EXPECT_EQ(read_text_file(calls()), "image_undistorter\n");
}

TEST_F(PhotosCommand, photos_are_found_in_folders_below_and_files_of_a_dot_are_not) {
    fs::create_directories(photos() / "left");
    for (const char* name : {"view_00.png", "view_01.png", "view_02.png"})
        fs::rename(photos() / name, photos() / "left" / name);
    write_file_atomic(photos() / "left/._view_00.png", std::string("no PNG"));
    const Outcome o = with_path("/nowhere", train());
    EXPECT_NE(o.err.find("apt install colmap"), std::string::npos) << o.err;
    fs::create_directories(photos() / "set/sparse");
    expect_refused({{train(), "set/sparse is below"}});
}

TEST_F(PhotosCommand, pictures_that_are_not_read_are_counted) {
    fs::remove_all(photos());
    for (const char* name : {"a.HEIC", "b.heic", "images/c.webp"})
        write_file_atomic(photos() / name, std::string("picture"));
    expect_refused({{train(), "2 .heic, 1 .webp"}, {train(), "Convert them to PNG or JPEG"}});
}

TEST_F(PhotosCommand, pictures_among_photos_that_are_not_read_are_told) {
    write_file_atomic(photos() / "a.HEIC", std::string("picture"));
    const Outcome o = with_path((scratch() / "bin").string() + ":/usr/bin:/bin",
                                fmt::format("train {} -o {} --iterations 1", photos().string(),
                                            (scratch() / "mixed").string()));
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.err.find("1 .heic in"), std::string::npos) << o.err;
    EXPECT_NE(o.err.find("heif-convert"), std::string::npos) << o.err;
}

TEST_F(PhotosCommand, masks_beside_the_photos_go_to_colmap_and_are_straightened_with_the_photos) {
    const ImageU8 photo = read_image(photos() / "view_00.png");
    ImageU8 mask(photo.width, photo.height, 1);
    for (int y = 0; y < mask.height; ++y)
        for (int x = 0; x < mask.width; ++x) mask.at(x, y, 0) = x < 40 ? 0 : 255;
    write_png(scratch() / "masks/view_00.png.png", mask);
    const std::string masks = (scratch() / "masks").string();
    EXPECT_NE(with_path("/nowhere", train()).err.find("--ImageReader.mask_path '" + masks + "'"),
              std::string::npos);
    const Outcome o = with_path((scratch() / "bin").string() + ":/usr/bin:/bin",
                                fmt::format("train {}/ -o {} --iterations 1", photos().string(),
                                            (scratch() / "with_masks").string()));
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.err.find("The masks of 1 photos were straightened"), std::string::npos) << o.err;
    const fs::path dense = scratch() / "with_masks/colmap/dense";
    EXPECT_EQ(read_image(dense / "masks/view_00.png.png").data, mask.data) << "a pinhole's";
    EXPECT_EQ(load_photo(load_dataset(dense).views[0]).at(39, 3, 3), 0);
}

TEST_F(PhotosCommand, output_among_the_photos_is_refused) {
    expect_refused({{"train " + photos().string() + " -o " + (photos() / "out").string(),
                     "lies among the photos"}});
}

}  // namespace
}  // namespace darb
