// SPDX-License-Identifier: MIT
#include "engine/data/colmap.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <sstream>

#include "engine/core/files.h"
#include "engine/data/camera_list.h"
#include "engine/data/depth_io.h"
#include "engine/data/image_io.h"
#include "engine/data/lens_model.h"
#include "engine/data/point_cloud_ply.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Bytes camera_file(int model = 1, double focal = 50, std::uint64_t width = 8) {
    Bytes file;
    file.put<std::uint64_t>(1).put<std::uint32_t>(3).put<std::int32_t>(model);
    file.put<std::uint64_t>(width).put<std::uint64_t>(6);
    return file.put(focal).put(51.0).put(4.0).put(3.0);
}

Bytes image_file(double qw = 1, double tx = 0.5, std::uint32_t camera = 3) {
    Bytes file;
    file.put<std::uint64_t>(1).put<std::uint32_t>(1);
    file.put(qw).put(0.0).put(0.0).put(0.0).put(tx).put(0.0).put(2.0);
    file.put(camera).text("a.png").put('\0').put<std::uint64_t>(1);
    return file.put(1.5).put(2.5).put<std::uint64_t>(7);
}

Bytes point_file(double x = 1e6 + 0.25) {
    Bytes file;
    file.put<std::uint64_t>(1).put<std::uint64_t>(7).put(x).put(2.0).put(3.0);
    file.put<std::uint8_t>(10).put<std::uint8_t>(20).put<std::uint8_t>(30).put(0.5);
    return file.put<std::uint64_t>(1).put<std::uint32_t>(1).put<std::uint32_t>(0);
}

/// A project folder with one photo of 8 x 6 px.
std::filesystem::path write_project(const Bytes& cameras, const Bytes& images,
                                    const Bytes& points) {
    const auto folder = test_folder();
    write_file_atomic(folder / "sparse/0/cameras.bin", cameras.data);
    write_file_atomic(folder / "sparse/0/images.bin", images.data);
    write_file_atomic(folder / "sparse/0/points3D.bin", points.data);
    write_png(folder / "images/a.png", ImageU8(8, 6, 3));
    return folder;
}

TEST(ColmapBinary, fields_are_read) {
    const Dataset dataset = load_dataset(write_project(camera_file(), image_file(), point_file()));
    ASSERT_EQ(dataset.views.size(), 1u);
    const Camera& camera = dataset.views[0].camera;
    EXPECT_EQ(camera.fx, 50);
    EXPECT_EQ(camera.fy, 51);
    EXPECT_EQ(camera.cx, 4);
    EXPECT_EQ(camera.cy, 3);
    EXPECT_EQ(camera.translation, glm::dvec3(0.5, 0, 2));
    EXPECT_EQ(dataset.source, "COLMAP binary");
    ASSERT_EQ(dataset.points.size(), 1u);
    EXPECT_EQ(dataset.points.position[0], 1e6 + 0.25) << "map coordinates stay double";
    EXPECT_EQ(dataset.points.colour, (std::vector<std::uint8_t>{10, 20, 30}));
}

TEST(ColmapBinary, truncated_at_every_byte_is_an_error_that_names_the_file) {
    const Bytes files[3] = {camera_file(), image_file(), point_file()};
    const char* names[3] = {"cameras.bin", "images.bin", "points3D.bin"};
    for (int which = 0; which < 3; ++which)
        for (std::size_t length = 0; length < files[which].data.size(); ++length) {
            const std::vector<std::byte> part(files[which].data.begin(),
                                              files[which].data.begin() + length);
            std::size_t dropped = 0;
            const std::string error = error_of([&] {
                if (which == 0) parse_colmap_cameras(part, names[0]);
                if (which == 1) parse_colmap_images(part, names[1]);
                if (which == 2) parse_colmap_points(part, names[2], dropped);
            });
            EXPECT_EQ(error.find(names[which]), 0u) << length << ": " << error;
        }
}

TEST(ColmapBinary, declared_counts_beyond_the_file_are_refused_before_allocating) {
    for (const std::uint64_t count : {2ull, 1ull << 31, 1ull << 32, 1ull << 63, ~0ull}) {
        Bytes files[3] = {camera_file(), image_file(), point_file()};
        for (Bytes& file : files) std::memcpy(file.data.data(), &count, 8);
        std::size_t dropped = 0;
        EXPECT_FALSE(error_of([&] { parse_colmap_cameras(files[0].data, "c"); }).empty());
        EXPECT_FALSE(error_of([&] { parse_colmap_images(files[1].data, "i"); }).empty());
        EXPECT_FALSE(error_of([&] { parse_colmap_points(files[2].data, "p", dropped); }).empty());
        // Observations and tracks.
        Bytes images = image_file(), points = point_file();
        std::memcpy(images.data.data() + images.data.size() - 32, &count, 8);
        std::memcpy(points.data.data() + points.data.size() - 16, &count, 8);
        EXPECT_NE(error_of([&] { parse_colmap_images(images.data, "i"); }).find("observations"),
                  std::string::npos);
        EXPECT_NE(error_of([&] { parse_colmap_points(points.data, "p", dropped); }).find("track"),
                  std::string::npos);
    }
}

TEST(ColmapBinary, bad_records_are_errors_with_reason) {
    const auto cameras = [](const Bytes& file) {
        return error_of([&] { parse_colmap_cameras(file.data, "cameras.bin"); });
    };
    const auto images = [](const Bytes& file) {
        return error_of([&] { parse_colmap_images(file.data, "images.bin"); });
    };
    EXPECT_NE(cameras(camera_file(18)).find("model id 18"), std::string::npos);
    EXPECT_NE(cameras(camera_file(-1)).find("model id -1"), std::string::npos);
    for (const double focal : {0.0, -5.0})
        EXPECT_NE(cameras(camera_file(1, focal)).find("focal"), std::string::npos);
    EXPECT_NE(cameras(camera_file(1, kNan)).find("not finite"), std::string::npos);
    for (const std::uint64_t width : {0ull, 1ull << 31, 1ull << 63})
        EXPECT_NE(cameras(camera_file(1, 50, width)).find("size"), std::string::npos);
    EXPECT_NE(images(image_file(0)).find("quaternion is zero"), std::string::npos);
    EXPECT_NE(images(image_file(kNan)).find("a.png"), std::string::npos);
    EXPECT_NE(images(image_file(1, kNan)).find("not finite"), std::string::npos);
}

TEST(ColmapBinary, model_that_does_not_fit_together_is_an_error) {
    const auto load = [](const Bytes& images) {
        return error_of([&] { load_dataset(write_project(camera_file(), images, point_file())); });
    };
    EXPECT_NE(load(image_file(1, 0, 9)).find("camera id 9"), std::string::npos);
    EXPECT_NE(load(Bytes().put<std::uint64_t>(0)).find("no images"), std::string::npos);
    const auto folder = write_project(camera_file(), image_file(), point_file());
    std::filesystem::remove(folder / "images/a.png");
    const std::string missing = error_of([&] { load_dataset(folder); });
    EXPECT_NE(missing.find("a.png"), std::string::npos);
    EXPECT_NE(missing.find("the photo is missing"), std::string::npos) << missing;
    EXPECT_NE(missing.find("colmap image_deleter"), std::string::npos) << missing;
    ASSERT_EQ(::mkfifo((folder / "images/a.png").c_str(), 0600), 0);
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("a.png: is a pipe"), std::string::npos);
    std::filesystem::remove(folder / "images/a.png");
    std::filesystem::remove(folder / "images");
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("images"), std::string::npos);
    EXPECT_NE(error_of([&] { load_dataset(folder / "nowhere"); }).find("exist"), std::string::npos);
    std::filesystem::remove_all(folder / "sparse");
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("no cameras"), std::string::npos);
}

TEST(ColmapBinary, the_folder_of_its_photos_names_a_project_too) {
    const auto folder = write_project(camera_file(), image_file(), point_file());
    std::filesystem::rename(folder / "images", folder / "photos");
    for (const auto& named : {folder / "photos", folder / "photos/"}) {
        const Dataset dataset = load_dataset(named);
        EXPECT_EQ(dataset.views.size(), 1u);
        EXPECT_EQ(dataset.root, folder);
        EXPECT_EQ(dataset.options.images_folder, "photos");
        EXPECT_EQ(dataset.views[0].photo, folder / "photos/a.png");
    }
    std::filesystem::create_directories(folder / "other");  // without photos
    EXPECT_NE(error_of([&] { load_dataset(folder / "other"); }).find("no cameras"),
              std::string::npos);
}

TEST(ColmapBinary, nan_points_are_dropped_with_a_note) {
    const Dataset dataset =
        load_dataset(write_project(camera_file(), image_file(), point_file(kNan)));
    EXPECT_EQ(dataset.points.size(), 0u);
    EXPECT_NE(dataset.notes.at(0).find("1 point"), std::string::npos);
}

TEST(ColmapProject, photo_of_another_size_scales_the_intrinsics) {
    const auto folder = write_project(camera_file(), image_file(), point_file());
    write_png(folder / "images/a.png", ImageU8(16, 12, 3));
    const Dataset dataset = load_dataset(folder);
    EXPECT_EQ(dataset.views[0].camera.width, 16);
    EXPECT_EQ(dataset.views[0].camera.fx, 100);
    EXPECT_EQ(dataset.views[0].camera.cy, 6);
    EXPECT_NE(dataset.notes.at(0).find("16 x 12"), std::string::npos);
    write_png(folder / "images_2/a.png", ImageU8(4, 3, 3));
    DatasetOptions options;
    options.images_folder = "images_2";
    EXPECT_EQ(load_dataset(folder, options).views[0].camera.fx, 25);
    write_png(folder / "images/a.png", ImageU8(12, 12, 3));
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("aspect"), std::string::npos);
}

TEST(ColmapProject, masks_become_alpha) {
    const auto folder = write_project(camera_file(), image_file(), point_file());
    ImageU8 mask(8, 6, 1);
    std::fill(mask.data.begin() + 8, mask.data.end(), std::uint8_t{255});
    for (const char* name : {"masks/a.png.png", "masks/a.png"}) {
        std::filesystem::remove_all(folder / "masks");
        write_png(folder / name, mask);
        const Dataset dataset = load_dataset(folder);
        EXPECT_TRUE(dataset.has_alpha);
        EXPECT_TRUE(dataset.alpha_is_mask);
        const ImageU8 photo = load_photo(dataset.views[0]);
        EXPECT_EQ(photo.at(3, 0, 3), 0);
        EXPECT_EQ(photo.at(3, 1, 3), 255);
    }
}

TEST(ColmapProject, a_mask_beside_alpha_channels_stays_a_mask) {
    const auto folder = write_project(camera_file(), image_file(), point_file());
    write_png(folder / "images/a.png", ImageU8(8, 6, 4));
    EXPECT_FALSE(load_dataset(folder).alpha_is_mask);
    write_png(folder / "masks/a.png", ImageU8(8, 6, 1));
    const Dataset dataset = load_dataset(folder);
    EXPECT_TRUE(dataset.has_alpha);
    EXPECT_TRUE(dataset.alpha_is_mask);
    EXPECT_NE(dataset.notes.back().find("alpha channels"), std::string::npos);
}

TEST(ColmapProject, masks_are_found_beside_a_folder_named_with_a_slash) {
    const auto folder = write_project(camera_file(), image_file(), point_file());
    write_png(folder / "images_2/a.png", ImageU8(4, 3, 3));
    write_png(folder / "masks/a.png", ImageU8(8, 6, 1));
    DatasetOptions options;
    options.images_folder = "images_2/";
    EXPECT_EQ(load_dataset(folder, options).views.at(0).mask, folder / "masks/a.png");
}

TEST(ColmapProject, model_folders_are_read_with_and_without_a_slash) {
    const auto folder = write_project(camera_file(), image_file(), point_file());
    for (const char* name : {"", "sparse/0", "sparse/0/", "sparse/0/.", "sparse", "sparse/"})
        EXPECT_EQ(load_dataset(folder / name).views.at(0).photo, folder / "images/a.png") << name;
}

TEST(ColmapProject, photos_are_found_by_backslashes_and_other_extensions) {
    const auto folder = test_folder();
    View view;
    view.name = "left\\a.JPG";
    view.camera = {.width = 8, .height = 6, .fx = 20, .fy = 20, .cx = 4, .cy = 3};
    write_colmap_binary(folder / "sparse/0", {view}, {});
    write_png(folder / "images/left/a.png", ImageU8(8, 6, 3));
    write_png(folder / "masks/left/a.png", ImageU8(8, 6, 1));
    const Dataset dataset = load_dataset(folder);
    EXPECT_EQ(dataset.views.at(0).photo, folder / "images/left/a.png");
    EXPECT_EQ(dataset.views.at(0).mask, folder / "masks/left/a.png");
}

// Names from another machine, names that repeat the folder, and photos that lie with the model.
TEST(ColmapProject, photos_are_found_by_the_end_of_their_names_with_a_note) {
    const Camera camera{.width = 8, .height = 6, .fx = 20, .fy = 20, .cx = 4, .cy = 3};
    const auto set_of = [&](const std::vector<std::string>& names,
                            const std::vector<std::string>& photos) {
        const auto folder = test_folder();
        std::vector<View> views(names.size());
        for (std::size_t i = 0; i < names.size(); ++i) {
            views[i].name = names[i];
            views[i].camera = camera;
        }
        write_colmap_binary(folder / "sparse/0", views, {});
        for (const std::string& photo : photos) write_png(folder / photo, ImageU8(8, 6, 3));
        return folder;
    };
    for (const char* prefix :
         {"C:\\Users\\me\\photos\\", "/home/me/photos/", "images/", "./", "\\\\server\\share\\"}) {
        const std::string head = prefix;
        const auto folder =
            set_of({head + "a.png", head + "b.JPG"}, {"images/a.png", "images/b.jpg"});
        write_png(folder / "masks/a.png", ImageU8(8, 6, 1));
        const Dataset dataset = load_dataset(folder);
        ASSERT_EQ(dataset.views.size(), 2u);
        EXPECT_EQ(dataset.views[0].photo.lexically_normal(), folder / "images/a.png") << prefix;
        EXPECT_EQ(dataset.views[1].photo.lexically_normal(), folder / "images/b.jpg");
        EXPECT_EQ(dataset.views[0].mask.lexically_normal(), folder / "masks/a.png");
        if (head == "./") continue;
        EXPECT_EQ(dataset.views[0].name, "a.png") << "outputs get no absolute names";
        EXPECT_TRUE(std::ranges::any_of(dataset.notes, [&](const std::string& note) {
            return note.find("2 photos, as " + head + "a.png is a.png") != std::string::npos;
        })) << prefix;
    }
    const auto deep =
        set_of({"/x/left/a.png", "/x/right/a.png"}, {"images/left/a.png", "images/right/a.png"});
    EXPECT_EQ(load_dataset(deep).views.at(1).photo, deep / "images/right/a.png");
    const auto one = set_of({"left/a.png", "right/a.png"}, {"images/a.png"});
    EXPECT_NE(error_of([&] { load_dataset(one); }).find("the photo of left/a.png as well"),
              std::string::npos);
    for (const char* place : {"a.png", "sparse/0/a.png", "sparse/a.png"}) {
        const auto flat = set_of({"a.png"}, {place});
        EXPECT_EQ(load_dataset(flat).views.at(0).photo, flat / place);
    }
}

// Follows each remedy that an error about a data set names, and checks that it helps.
TEST(ColmapProject, remedies_that_errors_name_work_as_typed) {
    const auto after = [](const std::string& text, const std::string& head) {
        const std::size_t begin = text.find(head);
        EXPECT_NE(begin, std::string::npos) << head << " in " << text;
        if (begin == std::string::npos) return std::string();
        const std::size_t from = begin + head.size();
        std::string word = text.substr(from, text.find_first_of(" ,\n", from) - from);
        if (word.ends_with('.')) word.pop_back();
        return word;
    };
    auto folder = write_project(camera_file(), image_file(), point_file());
    DatasetOptions options;
    for (const char* other : {"images_4", "photos", "RAW"}) {  // another folder of the photos
        std::filesystem::rename(folder / "images", folder / other);
        const std::string error = error_of([&] { load_dataset(folder); });
        options.images_folder = after(error, "--images ");
        EXPECT_EQ(load_dataset(folder, options).views.at(0).photo, folder / other / "a.png");
        std::filesystem::rename(folder / other, folder / "images");
    }
    std::filesystem::create_directories(folder / "photos");  // one that is there, without photos
    std::filesystem::rename(folder / "images/a.png", folder / "photos/a.png");
    options.images_folder = after(error_of([&] { load_dataset(folder); }), "--images ");
    EXPECT_EQ(load_dataset(folder, options).views.at(0).photo, folder / "photos/a.png");
    options.images_folder = "images_2";
    std::filesystem::rename(folder / "photos/a.png", folder / "images/a.png");
    options.images_folder = after(error_of([&] { load_dataset(folder, options); }), "--images ");
    EXPECT_EQ(options.images_folder, "images") << "a smaller size that is not there";
    options.resolution = 2;
    EXPECT_EQ(load_dataset(folder, options).views.at(0).camera.width, 4);

    folder = write_project(camera_file(), image_file(), point_file());
    write_png(folder / "masks/first.png", ImageU8(8, 6, 1));
    std::string error = error_of([&] { load_dataset(folder); });
    std::filesystem::rename(folder / "masks/first.png",
                            folder / "masks" / after(error, "photos, such as "));
    EXPECT_EQ(load_dataset(folder).views.at(0).mask, folder / "masks/a.png");

    ImageF depth(8, 6, 1);
    std::fill(depth.data.begin(), depth.data.end(), 1.0f);
    write_depth_png(folder / "depths/first.png", depth, kMillimetre);
    error = error_of([&] { load_dataset(folder); });
    EXPECT_NE(
        error.find("Name it like its photo in " + (folder / "images").string() + ", with .png"),
        std::string::npos);
    std::filesystem::rename(folder / "depths/first.png", folder / "depths/a.png");
    error = error_of([&] { load_dataset(folder); });  // one track does not tell the scale
    EXPECT_NE(error.find("--depth-scale"), std::string::npos) << error;
    options = {};
    options.depth_scale = 1;
    EXPECT_EQ(load_dataset(folder, options).depth_scale, 1);

    folder = write_project(camera_file(), image_file(), point_file());
    write_camera_list(folder / "list.json", load_dataset(folder).views);
    error = error_of([&] { load_dataset(folder / "list.json"); });
    EXPECT_NE(error.find("use it with --cameras"), std::string::npos) << error;
    EXPECT_EQ(load_cameras(folder / "list.json").size(), 1u);
    for (const auto& [key, value] :
         {std::pair<std::string, std::string>{"depth_unit_scale_factor", "0"},
          {"integer_depth_scale", "1000"},
          {"x_fov", "200"}}) {
        const auto text = [&key = key](const std::string& number) {
            return "{\"w\": 8, \"h\": 6, \"fl_x\": 10, \"" + key + "\": " + number +
                   ", \"frames\": [{\"file_path\": \"images/a.png\", \"transform_matrix\": "
                   "[[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]}";
        };
        write_file_atomic(folder / "t.json", text(value));
        error = error_of([&] { load_dataset(folder / "t.json"); });
        const std::string told = key == "integer_depth_scale"       ? after(error, "step: ")
                                 : key == "depth_unit_scale_factor" ? after(error, "step, such as ")
                                                                    : "60";
        write_file_atomic(folder / "t.json", text(told));
        EXPECT_EQ(load_dataset(folder / "t.json").views.size(), 1u) << told;
    }
}

// COLMAP 3.12 and later: a rig of two cameras, the second half a unit to the right of the first.
TEST(ColmapProject, frames_and_rigs_say_the_poses_as_in_colmap) {
    const auto folder = test_folder();
    const auto write = [&](bool binary, const std::string& second, bool with_pose) {
        std::filesystem::remove_all(folder / "sparse");
        for (const char* name : {"a.png", "b.png"})
            write_png(folder / "images" / name, ImageU8(8, 6, 3));
        const auto model = folder / "sparse/0";
        if (!binary) {
            write_file_atomic(model / "cameras.txt",
                              "1 PINHOLE 8 6 20 20 4 3\n2 PINHOLE 8 6 20 20 4 3\n");
            write_file_atomic(model / "images.txt",
                              "1 1 0 0 0 0 0 3 1 a.png\n\n2 " + second + " 2 b.png\n\n");
            write_file_atomic(model / "rigs.txt", std::string("# rigs\n7 2 CAMERA 1 CAMERA 2 ") +
                                                      (with_pose ? "1 0 1 0 0 -0.5 0 0" : "0") +
                                                      "\n");
            write_file_atomic(model / "frames.txt",
                              std::string("9 7 1 0 0 0 0 0 3 2 CAMERA 1 1 CAMERA 2 2\n"));
            return;
        }
        Bytes cameras, images, rigs, frames;
        cameras.put<std::uint64_t>(2);
        for (const std::uint32_t id : {1, 2}) {
            cameras.put(id).put<std::int32_t>(1).put<std::uint64_t>(8).put<std::uint64_t>(6);
            cameras.put(20.0).put(20.0).put(4.0).put(3.0);
        }
        images.put<std::uint64_t>(2);
        for (const std::uint32_t id : {1, 2}) {
            images.put(id);
            std::istringstream numbers(id == 1 ? "1 0 0 0 0 0 3" : second);
            for (double number; numbers >> number;) images.put(number);
            images.put(id).text(id == 1 ? "a.png" : "b.png").put('\0').put<std::uint64_t>(0);
        }
        rigs.put<std::uint64_t>(1).put<std::uint32_t>(7).put<std::uint32_t>(2);
        rigs.put<std::int32_t>(0).put<std::uint32_t>(1).put<std::int32_t>(0).put<std::uint32_t>(2);
        rigs.put<std::uint8_t>(with_pose ? 1 : 0);
        if (with_pose)
            for (const double number : {0.0, 1.0, 0.0, 0.0, -0.5, 0.0, 0.0}) rigs.put(number);
        frames.put<std::uint64_t>(1).put<std::uint32_t>(9).put<std::uint32_t>(7);
        for (const double number : {1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0}) frames.put(number);
        frames.put<std::uint32_t>(2);
        for (const std::uint32_t id : {1, 2})
            frames.put<std::int32_t>(0).put(id).put<std::uint64_t>(id);
        write_file_atomic(model / "cameras.bin", cameras.data);
        write_file_atomic(model / "images.bin", images.data);
        write_file_atomic(model / "rigs.bin", rigs.data);
        write_file_atomic(model / "frames.bin", frames.data);
        for (const auto& [bytes, rig] : {std::pair{rigs.data, true}, std::pair{frames.data, false}})
            for (std::size_t length = 0; length < bytes.size(); ++length) {
                const auto part = std::span(bytes).first(length);
                EXPECT_FALSE(error_of([&, is_rig = rig] {
                                 if (is_rig)
                                     parse_colmap_rigs(part, "rigs.bin");
                                 else
                                     parse_colmap_frames(part, "frames.bin");
                             }).empty());
            }
    };
    const std::string right = "0 1 0 0 -0.5 0 -3", other = "1 0 0 0 9 0 3";
    for (const bool binary : {false, true}) {
        write(binary, right, true);
        Dataset dataset = load_dataset(folder);
        EXPECT_TRUE(dataset.notes.empty()) << dataset.notes.at(0);
        EXPECT_EQ(dataset.views.at(1).camera.translation, glm::dvec3(-0.5, 0, -3));
        write(binary, other, true);
        dataset = load_dataset(folder);
        EXPECT_NEAR(glm::length(dataset.views.at(1).camera.translation - glm::dvec3(-0.5, 0, -3)),
                    0, 1e-12);
        EXPECT_NEAR(dataset.views.at(1).camera.rotation[1][1], -1, 1e-12);
        ASSERT_EQ(dataset.notes.size(), 1u);
        for (const char* part : {"1 of 2 poses", "b.png at 0.5, 0, -3, not at -9, 0, -3"})
            EXPECT_NE(dataset.notes[0].find(part), std::string::npos) << dataset.notes[0];
        write(binary, other, false);
        dataset = load_dataset(folder);
        EXPECT_TRUE(dataset.notes.empty()) << "the rig does not know";
        EXPECT_EQ(dataset.views.at(1).camera.translation, glm::dvec3(9, 0, 3));
    }
    write(false, right, true);
    write_file_atomic(folder / "sparse/0/frames.txt",
                      std::string("9 7 1 0 0 0 0 0 3 2 CAMERA 1 1 CAMERA 1 2\n"));
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("has camera 2, but camera 1"),
              std::string::npos);
    write_file_atomic(folder / "sparse/0/frames.txt",
                      std::string("9 8 1 0 0 0 0 0 3 2 CAMERA 1 1 CAMERA 2 2\n"));
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("rig 8"), std::string::npos);
}

TEST(ColmapProject, cameras_of_a_transforms_file_beside_it_are_compared) {
    const auto folder = test_folder();
    std::vector<View> views(5);
    for (std::size_t i = 0; i < views.size(); ++i) {
        views[i].name = std::to_string(i) + ".png";
        views[i].camera = {.width = 8, .height = 6, .fx = 20, .fy = 20, .cx = 4, .cy = 3};
        views[i].camera.rotation = rotation_from_quaternion({1, 0.1 * double(i), 0, 0}, "test");
        views[i].camera.translation = {double(i * i), 1, 0};
        write_png(folder / "images" / views[i].name, ImageU8(8, 6, 3));
    }
    write_colmap_binary(folder / "sparse/0", views, {});
    // The same cameras, with the world turned, scaled by 2 and moved.
    const auto note = [&](double focal, std::size_t odd, bool turned) {
        std::string frames;
        for (std::size_t i = 0; i < views.size(); ++i) {
            const glm::dmat3 world = rotation_from_quaternion({1, 0.5, 0.2, 0.3}, "test");
            glm::dmat3 axes = world * glm::transpose(views[i].camera.rotation);
            glm::dvec3 at = 2.0 * (world * views[i].camera.centre()) + glm::dvec3(5, 6, 7);
            if (i == 2 && turned) axes = axes * rotation_from_quaternion({1, 0, 0.2, 0}, "test");
            if (i == odd) at *= 3.0;
            axes[1] = -axes[1];
            axes[2] = -axes[2];
            frames += std::string(i == 0 ? "" : ",") + "{\"file_path\": \"images/" + views[i].name +
                      "\", \"transform_matrix\": [";
            for (int r = 0; r < 3; ++r) {
                std::ostringstream row;
                row.precision(17);
                row << (r == 0 ? "[" : ",[") << axes[0][r] << "," << axes[1][r] << "," << axes[2][r]
                    << "," << at[r] << "]";
                frames += row.str();
            }
            frames += "]}";
        }
        write_file_atomic(folder / "transforms.json", "{\"fl_x\": " + std::to_string(focal) +
                                                          ", \"frames\": [" + frames + "]}");
        const Dataset dataset = load_dataset(folder);
        EXPECT_EQ(dataset.source, "COLMAP binary");
        EXPECT_EQ(dataset.notes.size(), 1u);
        EXPECT_NE(dataset.notes.at(0).find("name the transforms file itself"), std::string::npos);
        return dataset.notes.at(0);
    };
    EXPECT_EQ(note(20, 9, false).find("Warning"), std::string::npos);
    EXPECT_NE(note(24, 9, false).find("2.500 of its width in COLMAP binary, and 3.000"),
              std::string::npos);
    EXPECT_NE(note(20, 9, true).find("the turn from 1.png to 2.png"), std::string::npos);
    EXPECT_NE(note(20, 0, false).find("1 of 4 ways"), std::string::npos);
}

TEST(ColmapProject, photos_that_were_converted_are_found) {
    const auto folder = test_folder();
    std::vector<View> views(1);
    views[0].camera = {.width = 8, .height = 6, .fx = 20, .fy = 20, .cx = 4, .cy = 3};
    for (const char* extension : {".tif", ".TIFF", ".webp", ".bmp", ".HEIC"}) {
        views[0].name = std::string("a") + extension;
        write_colmap_binary(folder / "sparse/0", views, {});
        write_file_atomic(folder / "images" / views[0].name, std::string("no PNG"));
        EXPECT_NE(error_of([&] { load_dataset(folder); }).find("is no PNG"), std::string::npos);
        write_png(folder / "images/a.png", ImageU8(8, 6, 3));
        EXPECT_EQ(load_dataset(folder).views.at(0).photo, folder / "images/a.png") << extension;
        std::filesystem::remove(folder / "images" / views[0].name);
        EXPECT_EQ(load_dataset(folder).views.at(0).photo, folder / "images/a.png") << extension;
        std::filesystem::remove(folder / "images/a.png");
    }
}

TEST(ColmapProject, photos_above_the_folder_are_taken_for_a_model_named_itself_alone) {
    const auto folder = write_project(camera_file(), image_file(), point_file()),
               inner = folder / "in";
    std::filesystem::create_directories(inner);
    for (const char* model : {"sparse/0", "sparse"}) {
        std::filesystem::remove_all(inner / "sparse");
        std::filesystem::create_directories((inner / model).parent_path());
        std::filesystem::copy(folder / "sparse/0", inner / model);
        EXPECT_NE(error_of([&] { load_dataset(inner); }).find((inner / "images").string()),
                  std::string::npos);
    }
    std::filesystem::create_directories(folder / "other");
    std::filesystem::copy(folder / "sparse/0", folder / "other/0");
    EXPECT_EQ(load_dataset(folder / "other/0").views.at(0).photo, folder / "images/a.png");
    EXPECT_EQ(load_dataset(folder / "other").views.at(0).photo, folder / "images/a.png");
}

TEST(ColmapProject, smaller_photos_alone_are_named_in_the_remedy) {
    const auto folder = write_project(camera_file(), image_file(), point_file());
    std::filesystem::rename(folder / "images", folder / "images_4");
    const std::string error = error_of([&] { load_dataset(folder); });
    EXPECT_NE(error.find("--images images_4"), std::string::npos) << error;
}

TEST(ColmapProject, other_pieces_of_a_reconstruction_are_noted_with_their_photos) {
    const auto folder = write_project(camera_file(), image_file(), point_file());
    View view;
    view.camera = {.width = 8, .height = 6, .fx = 20, .fy = 20, .cx = 4, .cy = 3};
    for (const char* name : {"1", "2"}) {
        view.name = "a.png";
        std::vector<View> views(name[0] == '1' ? 5 : 2, view);
        write_colmap_binary(folder / "sparse" / name, views, {});
    }
    write_file_atomic(folder / "sparse/3/cameras.txt", "1 PINHOLE 8 6 20 20 4 3\n");
    write_file_atomic(folder / "sparse/3/images.txt", "1 1 0 0 0 0 0 0 1 a.png\n\n");
    const Dataset dataset = load_dataset(folder);
    ASSERT_EQ(dataset.notes.size(), 1u);
    for (const char* part : {"sparse/0, of 1 photo,", "1 of 5 photos", "2 of 2 photos",
                             "3 of 1 photo", "name its folder"})
        EXPECT_NE(dataset.notes[0].find(part), std::string::npos)
            << part << ": " << dataset.notes[0];
    EXPECT_EQ(load_dataset(folder / "sparse/1").views.size(), 5u);
}

TEST(ColmapProject, a_ply_of_other_points_outranks_those_of_the_model) {
    const auto folder = write_project(camera_file(), image_file(), point_file());
    const auto write_ply = [&](std::size_t count) {
        std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) + "\n";
        for (const char* name : {"x", "y", "z"})
            text += "property float " + std::string(name) + "\n";
        text += "end_header\n";
        for (std::size_t i = 0; i < count; ++i) text += "5 0 9\n";
        write_file_atomic(folder / "sparse/0/points3D.ply", text);
    };
    write_ply(1);  // as 3DGS writes it from the model
    const Dataset own = load_dataset(folder);
    EXPECT_EQ(own.points.position.at(0), 1e6 + 0.25);
    EXPECT_EQ(own.points.seen_by.size(), 1u);
    EXPECT_TRUE(own.notes.empty());
    write_ply(3);
    const Dataset replaced = load_dataset(folder);
    EXPECT_EQ(replaced.points.size(), 3u);
    EXPECT_TRUE(replaced.points.seen_by.empty());
    ASSERT_EQ(replaced.notes.size(), 2u);
    EXPECT_NE(replaced.notes[0].find("has no colours"), std::string::npos) << replaced.notes[0];
    EXPECT_NE(replaced.notes[1].find("points3D.ply was read, 3 points"), std::string::npos)
        << replaced.notes[1];
}

TEST(PointCloudPly, a_splat_scene_has_the_colours_of_its_f_dc) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex 3\n";
    for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"})
        text += "property float " + std::string(name) + "\n";
    text += "end_header\n0 0 0 0 0 0 1\n0 0 1 1.7725 -1.7725 9 1\n0 1 0 nan 0 0 1\n";
    std::size_t dropped = 0;
    std::vector<std::string> notes;
    const auto file = std::as_bytes(std::span(text.data(), text.size()));
    const PointCloud points =
        parse_point_cloud_ply(file, parse_ply_header(file, "p"), "p", dropped, &notes);
    using Colours = std::vector<std::uint8_t>;
    EXPECT_EQ(points.colour, (Colours{128, 128, 128, 255, 0, 255, 128, 128, 128}));
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("f_dc"), std::string::npos);
}

TEST(PointCloudPly, points_that_float32_rounded_are_noted) {
    const auto notes_at = [](double far, bool doubles) {
        const auto folder = write_project(camera_file(), image_file(), point_file());
        std::string text = "ply\nformat ascii 1.0\nelement vertex 1000\n";
        for (const char* name :
             {"double x", "double y", "double z", "uchar red", "uchar green", "uchar blue"})
            text += "property " + std::string(name) + "\n";
        text += "end_header\n";
        for (int i = 0; i < 1000; ++i) {
            const double x = far + 0.1 * (i % 10) + 0.01, y = 0.1 * (i / 10 % 10),
                         z = 0.1 * (i / 100);
            text += doubles ? fmt::format("{} {} {} 1 2 3\n", x, y, z)
                            : fmt::format("{} {} {} 1 2 3\n", static_cast<float>(x),
                                          static_cast<float>(y), static_cast<float>(z));
        }
        write_file_atomic(folder / "sparse/0/points3D.ply", text);
        std::string notes;
        for (const std::string& note : load_dataset(folder).notes) notes += note + "\n";
        return notes;
    };
    EXPECT_NE(notes_at(4e6, false).find("steps of 0.25, as float32"), std::string::npos)
        << notes_at(4e6, false);
    EXPECT_EQ(notes_at(4e6, true).find("as float32"), std::string::npos);
    EXPECT_EQ(notes_at(0, false).find("as float32"), std::string::npos);
    EXPECT_EQ(notes_at(2000, false).find("as float32"), std::string::npos);
}

TEST(PointCloudPly, colours_of_floats_are_up_to_1_or_up_to_255) {
    const auto colours = [](const std::string& prefix, const std::string& rows) {
        std::string text = "ply\nformat ascii 1.0\nelement vertex 2\n";
        for (const char* name : {"x", "y", "z"})
            text += "property float " + std::string(name) + "\n";
        for (const char* name : {"red", "green", "blue"})
            text += "property float " + prefix + name + "\n";
        text += "end_header\n" + rows;
        std::size_t dropped = 0;
        return parse_point_cloud_ply(std::as_bytes(std::span(text.data(), text.size())), "p",
                                     dropped)
            .colour;
    };
    using Colours = std::vector<std::uint8_t>;
    EXPECT_EQ(colours("", "0 0 0 0 0.2 1\n0 0 0 1 nan 0\n"), (Colours{0, 51, 255, 255, 128, 0}));
    EXPECT_EQ(colours("", "0 0 0 0 1 200\n0 0 0 255 2 0\n"), (Colours{0, 1, 200, 255, 2, 0}));
    EXPECT_EQ(colours("diffuse_", "0 0 0 0 1 1\n0 0 0 0 1 0\n"), (Colours{0, 255, 255, 0, 255, 0}));
}

TEST(ColmapProject, hold_out_takes_every_eighth_by_name) {
    const auto folder = test_folder();
    std::vector<View> views(17);
    for (std::size_t i = 0; i < views.size(); ++i) {
        views[i].name = "v" + std::to_string(100 + (i * 5) % 17) + ".png";
        views[i].camera.width = views[i].camera.height = 4;
        views[i].camera.fx = views[i].camera.fy = 4;
        ImageU8 photo(4, 4, 3);
        photo.data[0] = static_cast<std::uint8_t>(i);  // equal photos would count as one
        write_png(folder / "images" / views[i].name, photo);
    }
    write_colmap_binary(folder / "sparse" / "0", views, {});
    DatasetOptions options;
    options.hold_out = true;
    const Dataset dataset = load_dataset(folder, options);
    for (std::size_t i = 0; i < 17; ++i) EXPECT_EQ(dataset.views[i].is_test, i % 8 == 0) << i;
    EXPECT_EQ(dataset.views[16].name, "v116.png");
}

TEST(ColmapProject, test_list_beside_the_model_is_held_out_in_place_of_every_eighth) {
    const auto folder = test_folder();
    std::vector<View> views(9);
    for (std::size_t i = 0; i < views.size(); ++i) {
        views[i].name = "v" + std::to_string(i) + ".png";
        views[i].camera.width = views[i].camera.height = 4;
        views[i].camera.fx = views[i].camera.fy = 4;
        write_png(folder / "images" / views[i].name, ImageU8(4, 4, 3));
    }
    write_colmap_binary(folder / "sparse" / "0", views, {});
    write_file_atomic(folder / "test.txt", "v3.png\r\nv5.png\nnowhere.png\n");
    for (const bool hold_out : {false, true}) {
        DatasetOptions options;
        options.hold_out = hold_out;
        const Dataset dataset = load_dataset(folder, options);
        for (std::size_t i = 0; i < 9; ++i)
            EXPECT_EQ(dataset.views[i].is_test, i == 3 || i == 5) << i;
        std::string notes;
        for (const std::string& note : dataset.notes) notes += note;
        EXPECT_NE(notes.find("test.txt names 1 photo "), std::string::npos) << notes;
    }
}

TEST(ColmapWrite, model_reads_back) {
    std::vector<View> views(3);
    for (std::size_t i = 0; i < 3; ++i) {
        views[i].name = "folder/photo " + std::to_string(i) + ".png";
        views[i].camera = {.width = 64, .height = 48, .fx = 70, .fy = 71, .cx = 31, .cy = 25};
        views[i].camera.rotation =
            rotation_from_quaternion({0.1, 0.5 * static_cast<double>(i), -0.3, 0.8}, "test");
        views[i].camera.translation = {1e6, -2, static_cast<double>(i)};
    }
    views[2].camera.fx = 80;
    PointCloud points;
    points.position = {1, 2, 3, 1e6, 5e6, -4};
    points.colour = {1, 2, 3, 250, 251, 252};
    const auto folder = test_folder();
    write_colmap_binary(folder, views, points);
    const ColmapModel model = read_colmap(folder);
    EXPECT_EQ(model.cameras.size(), 2u);
    ASSERT_EQ(model.images.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(model.images[i].name, views[i].name);
        EXPECT_EQ(model.images[i].translation, views[i].camera.translation);
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(glm::length(model.images[i].rotation[c] - views[i].camera.rotation[c]), 0,
                        1e-14);
        EXPECT_EQ(model.cameras.at(model.images[i].camera_id).parameters[0], views[i].camera.fx);
    }
    EXPECT_EQ(model.points.position, points.position);
    EXPECT_EQ(model.points.colour, points.colour);
}

}  // namespace
}  // namespace darb
