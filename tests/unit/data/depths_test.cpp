// SPDX-License-Identifier: MIT
// Measured depths beside the photos: files, names, sizes, lenses, the scale of a scene.
#include "engine/data/depths.h"

#include <cmath>
#include <fstream>
#include <limits>
#include <map>

#include "engine/core/files.h"
#include "engine/data/colmap.h"
#include "engine/data/depth_io.h"
#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

/// An .npy file of this type and shape.
template <class T>
void write_npy(const fs::path& path, const std::string& type, const std::string& shape,
               const std::vector<T>& values) {
    std::string header =
        "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
    header += '\n';
    Bytes file;
    file.text("\x93NUMPY").put(std::uint8_t{1}).put(std::uint8_t{0});
    file.put(static_cast<std::uint16_t>(header.size())).text(header);
    for (const T value : values) file.put(value);
    write_file_atomic(path, file.data);
}

TEST(DepthFiles, png_is_in_millimetres_and_npy_of_floats_in_metres) {
    const fs::path folder = test_folder();
    ImageF depth(3, 2, 1);
    depth.data = {1.5f, 0, 0.25f, 2, 3, 60};
    write_depth_png(folder / "a.png", depth, kMillimetre);
    EXPECT_EQ(read_depth(folder / "a.png").data, depth.data);
    const ImageF other = read_depth(folder / "a.png", 0.01);
    EXPECT_FLOAT_EQ(other.data[0], 15);
    const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
    write_npy<double>(folder / "b.npy", "<f8", "2, 3", {1.5, nan, 0.25, infinite, -1, 60});
    EXPECT_EQ(read_depth(folder / "b.npy").data, (std::vector<float>{1.5f, 0, 0.25f, 0, 0, 60}));
    write_npy<std::uint16_t>(folder / "c.npy", "<u2", "1, 2, 1", {1500, 0});
    EXPECT_EQ(read_depth(folder / "c.npy").data, (std::vector<float>{1.5f, 0}));
}

// 4 x 3 px, written by libtiff: big-endian, LZW with differences of uint16, the last one 0;
// little-endian, deflate with differences of float bytes, the last one -9999.
constexpr const char* kLzwTiff =
    "4d4d002a0000001e8000dd0007d41208076841a0afa05ae214f22a404000000c010000030000000100040000"
    "0101000300000001000300000102000300000001001000000103000300000001000500000106000300000001"
    "0001000001110004000000010000000801150003000000010001000001160003000000010003000001170004"
    "0000000100000015011c00030000000100010000013d00030000000100020000015300030000000100010000"
    "00000000";
constexpr const char* kDeflateTiff =
    "49492a0034000000789cb3676060705450505060800007060686030202021710fcb62a01813d4f18186c8e30"
    "30300000851a07010c0000010300010000000400000001010300010000000300000002010300010000002000"
    "0000030103000100000008000000060103000100000001000000110104000100000008000000150103000100"
    "00000100000016010300010000000300000017010400010000002c0000001c01030001000000010000003d01"
    "0300010000000300000053010300010000000300000000000000";

std::vector<std::byte> from_hex(const std::string& text) {
    std::vector<std::byte> bytes;
    for (std::size_t i = 0; i < text.size(); i += 2)
        bytes.push_back(static_cast<std::byte>(std::stoi(text.substr(i, 2), nullptr, 16)));
    return bytes;
}

/// A little-endian TIFF of 3 x 2 floats in strips of one row, with the additional fields `more`.
std::vector<std::byte> float_tiff(const std::vector<float>& values,
                                  const std::map<std::uint16_t, std::uint32_t>& more = {}) {
    std::map<std::uint16_t, std::uint32_t> fields{{256, 3}, {257, 2}, {258, 32}, {259, 1}, {277, 1},
                                                  {278, 1}, {339, 3}, {273, 0},  {279, 0}};
    for (const auto& [tag, value] : more) fields[tag] = value;
    Bytes file;
    file.text("II").put<std::uint16_t>(42).put<std::uint32_t>(8 + 24 + 16);
    for (const float value : values) file.put(value);
    for (const std::uint32_t value : {8, 20, 12, 12}) file.put(value);
    file.put(static_cast<std::uint16_t>(fields.size()));
    for (const auto& [tag, value] : fields) {
        const bool list = tag == 273 || tag == 279;
        file.put(tag).put<std::uint16_t>(list ? 4 : 3).put<std::uint32_t>(list ? 2 : 1);
        file.put<std::uint32_t>(tag == 273 ? 32 : tag == 279 ? 40 : value);
    }
    return file.put<std::uint32_t>(0).data;
}

TEST(DepthFiles, tiff_of_floats_is_in_metres_and_of_integers_in_millimetres) {
    const fs::path folder = test_folder();
    write_file_atomic(folder / "a.tif", float_tiff({1.5f, 0, 0.25f, 2, -9999, 60}));
    EXPECT_EQ(read_depth(folder / "a.tif").data, (std::vector<float>{1.5f, 0, 0.25f, 2, 0, 60}));
    EXPECT_EQ(read_depth(folder / "a.tif", 0.5).data[0], 0.75f);
    EXPECT_EQ(read_depth(folder / "a.tif", 0.5, true).data[0], 1.5f) << "of integers alone";
    write_file_atomic(folder / "lzw.tiff", from_hex(kLzwTiff));
    write_file_atomic(folder / "deflate.tif", from_hex(kDeflateTiff));
    const ImageF lzw = read_depth(folder / "lzw.tiff"),
                 deflate = read_depth(folder / "deflate.tif");
    ASSERT_EQ(lzw.width, 4);
    ASSERT_EQ(deflate.height, 3);
    for (int i = 0; i < 12; ++i) {
        const float expected = i == 11 ? 0.0f : 1 + 0.25f * static_cast<float>(i);
        EXPECT_FLOAT_EQ(lzw.data[i], expected) << i;
        EXPECT_EQ(deflate.data[i], expected) << i;
    }
}

TEST(DepthFiles, tiff_that_is_damaged_or_of_another_kind_is_refused) {
    const fs::path file = test_folder() / "a.tif";
    const std::vector<float> values{1, 2, 3, 4, 5, 6};
    const auto write = [&](const std::vector<std::byte>& bytes) {  // thousands: without fsync
        std::ofstream out(file, std::ios::binary);
        out.write(reinterpret_cast<const char*>(bytes.data()),
                  static_cast<std::streamsize>(bytes.size()));
    };
    const auto refused = [&](const std::vector<std::byte>& bytes) {
        write(bytes);
        return error_of([&] { read_depth(file); });
    };
    const std::map<std::uint16_t, std::uint32_t> three{{277, 3}}, eight{{258, 8}, {339, 1}},
        jpeg{{259, 7}}, huge{{256, 60'000}, {257, 60'000}}, no_rows{{278, 0}}, odd{{317, 9}};
    for (const auto& [fields, part] : {std::pair{three, "3 channels"},
                                       {eight, "8 bits"},
                                       {jpeg, "compression 7"},
                                       {huge, "60000"},
                                       {no_rows, "no size"},
                                       {odd, "predictor 9"}}) {
        const std::string error = refused(float_tiff(values, fields));
        EXPECT_NE(error.find("a.tif"), std::string::npos) << error;
        EXPECT_NE(error.find(part), std::string::npos) << error;
    }
    for (const std::vector<std::byte>& whole :
         {float_tiff(values), from_hex(kLzwTiff), from_hex(kDeflateTiff)}) {
        for (std::size_t length = 1; length + 6 < whole.size(); ++length)
            EXPECT_FALSE(refused({whole.begin(), whole.begin() + length}).empty()) << length;
        for (std::size_t at = 0; at < whole.size(); ++at)
            for (const int value : {0, 0x55, 0xff}) {
                std::vector<std::byte> damaged = whole;
                damaged[at] = static_cast<std::byte>(value);
                write(damaged);
                try {
                    read_depth(file);
                } catch (const Error&) {  // or other depths
                }
            }
    }
}

TEST(DepthFiles, what_is_no_depth_is_refused_by_name) {
    const fs::path folder = test_folder();
    const auto refused = [&](const std::string& name, const std::string& part) {
        const std::string error = error_of([&] { read_depth(folder / name); });
        EXPECT_NE(error.find(name), std::string::npos) << error;
        EXPECT_NE(error.find(part), std::string::npos) << error;
    };
    write_png(folder / "eight.png", ImageU8(2, 2, 1));
    refused("eight.png", "8 bits");
    write_depth_png(folder / "empty.png", ImageF(2, 2, 1), kMillimetre);
    refused("empty.png", "no measured depth");
    write_npy<float>(folder / "cut.npy", "<f4", "20, 30", {1, 2});
    refused("cut.npy", "");
    write_npy<std::uint8_t>(folder / "bytes.npy", "|u1", "1, 2", {1, 2});
    refused("bytes.npy", "|u1");
    write_npy<float>(folder / "line.npy", "<f4", "2,", {1, 2});
    refused("line.npy", "two dimensions");
    write_file_atomic(folder / "text.npy", std::string("depth"));
    refused("text.npy", "");
}

/// Photos a.png and b.png of 8 x 6 px, with a COLMAP model or a transforms file.
fs::path write_set(bool colmap, const std::string& more = "", const std::string& of_file = "") {
    const fs::path folder = test_folder();
    std::vector<View> views(2);
    std::string frames;
    for (int i = 0; i < 2; ++i) {
        views[i].name = i == 0 ? "a.png" : "b.png";
        views[i].camera = {.width = 8, .height = 6, .fx = 10, .fy = 10, .cx = 4, .cy = 3};
        write_png(folder / "images" / views[i].name, ImageU8(8, 6, 3));
        frames += (frames.empty() ? "" : ",") + std::string(R"({"file_path": "images/)") +
                  views[i].name + "\", " + (i == 0 ? more : "") +
                  R"("transform_matrix": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]})";
    }
    if (colmap)
        write_colmap_binary(folder / "sparse/0", views, {});
    else
        write_file_atomic(folder / "transforms.json",
                          "{\"fl_x\": 10, " + of_file + "\"frames\": [" + frames + "]}");
    return folder;
}

ImageF ramp(int width, int height) {
    ImageF depth(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            depth.at(x, y, 0) = static_cast<float>(1 + 0.01 * (x + 0.5) / width);
    return depth;
}

TEST(Depths, are_found_beside_the_photos_of_either_source) {
    for (const bool colmap : {false, true})
        for (const char* name : {"depths/a.png", "depths/a.png.png", "depth/a.png"}) {
            const fs::path set = write_set(colmap);
            write_depth_png(set / name, ramp(8, 6), kMillimetre);
            const Dataset dataset = load_dataset(set);
            EXPECT_EQ(dataset.views.at(0).depth, set / name);
            EXPECT_TRUE(dataset.views.at(1).depth.empty());
            EXPECT_EQ(dataset.depth_scale, 1);
        }
}

TEST(Depths, of_a_transforms_file_have_its_unit) {
    const fs::path set = write_set(false, R"("depth_file_path": "lidar/x.png", )",
                                   R"("depth_unit_scale_factor": 0.01, )");
    write_depth_png(set / "lidar/x.png", ramp(8, 6), kMillimetre);
    const Dataset dataset = load_dataset(set);
    EXPECT_NEAR(load_depth(dataset.views.at(0)).data[0], 10, 0.2);
    fs::remove(set / "lidar/x.png");
    const std::string error = error_of([&] { load_dataset(set); });
    EXPECT_NE(error.find("lidar/x.png is missing"), std::string::npos) << error;
}

// 3DGS's make_depth_scale.py leaves the file; read as millimetres they would be nonsense.
TEST(Depths, that_a_network_estimated_inversely_are_left_out_with_a_note) {
    const fs::path set = write_set(true);
    write_depth_png(set / "depths/a.png", ramp(8, 6), kMillimetre);
    ASSERT_FALSE(load_dataset(set).views.at(0).depth.empty());
    write_file_atomic(set / "sparse/0/depth_params.json", R"({"a": {"scale": 1, "offset": 0}})");
    const Dataset dataset = load_dataset(set);
    EXPECT_TRUE(dataset.views.at(0).depth.empty());
    ASSERT_FALSE(dataset.notes.empty());
    EXPECT_NE(dataset.notes.back().find("depth_params.json"), std::string::npos)
        << dataset.notes.back();
}

// instant-ngp: integer_depth_scale applies to integers only; nerfstudio: poses may have been
// scaled.
TEST(Depths, of_other_dialects_of_transforms_have_their_scale) {
    const std::string scale = R"("integer_depth_scale": 1e-4, )";
    fs::path set = write_set(false, R"("depth_path": "lidar/x.png", )", scale);
    write_depth_png(set / "lidar/x.png", ramp(8, 6), 1e-4);
    EXPECT_NEAR(load_depth(load_dataset(set).views.at(0)).data[0], 1, 0.02);
    set = write_set(false, R"("depth_path": "lidar/x.npy", )", scale);
    write_npy<float>(set / "lidar/x.npy", "<f4", "6, 8", std::vector<float>(48, 1.5f));
    EXPECT_EQ(load_depth(load_dataset(set).views.at(0)).data[0], 1.5f);
    set =
        write_set(false, R"("depth_path": "lidar/x.png", )", R"("enable_depth_loading": false, )");
    const Dataset without = load_dataset(set);
    EXPECT_TRUE(without.views.at(0).depth.empty());
    ASSERT_EQ(without.notes.size(), 1u);
    EXPECT_NE(without.notes[0].find("enable_depth_loading"), std::string::npos);
    set = write_set(false, R"("depth_file_path": "lidar/x.png", )", R"("applied_scale": 0.25, )");
    write_depth_png(set / "lidar/x.png", ramp(8, 6), kMillimetre);
    EXPECT_EQ(load_dataset(set).depth_scale, 0.25);
    DatasetOptions asked;
    asked.depth_scale = 3;
    EXPECT_EQ(load_dataset(set, asked).depth_scale, 3);
}

TEST(Depths, of_near_names_are_found_and_what_is_not_read_is_noted) {
    for (const char* name :
         {"depths/a.tif", "depths/a.tiff", "Depths/a.png", "DEPTH/a.png", "depths/a_depth.png",
          "depth/a.png.tif", "images/a_depth.png", "images/a.depth.tif"}) {
        const fs::path set = write_set(true);
        if (std::string(name).find(".tif") != std::string::npos)
            write_file_atomic(set / name, from_hex(kLzwTiff));
        else
            write_depth_png(set / name, ramp(8, 6), kMillimetre);
        EXPECT_EQ(load_dataset(set).views.at(0).depth, set / name);
    }
    for (const char* name : {"depths/a.exr", "depth_maps/a.png", "lidar_depth/a.bin"}) {
        const fs::path set = write_set(true);
        write_file_atomic(set / name, std::string("x"));
        const Dataset dataset = load_dataset(set);
        EXPECT_TRUE(dataset.views.at(0).depth.empty());
        ASSERT_EQ(dataset.notes.size(), 1u) << name;
        EXPECT_NE(dataset.notes[0].find(fs::path(name).parent_path().string()), std::string::npos);
        EXPECT_NE(dataset.notes[0].find(fs::path(name).filename().string()), std::string::npos);
    }
}

TEST(Depths, without_a_photo_or_of_another_shape_are_refused) {
    const fs::path set = write_set(false);
    write_depth_png(set / "depths/c.png", ramp(8, 6), kMillimetre);
    std::string error = error_of([&] { load_dataset(set); });
    EXPECT_NE(error.find("c.png: belongs to no photo"), std::string::npos) << error;
    write_png(set / "images/c.png", ImageU8(8, 6, 3));  // a photo that is no view
    const Dataset dataset = load_dataset(set);
    View view = dataset.views[0];
    view.depth = set / "depths/c.png";
    write_depth_png(view.depth, ramp(8, 12), kMillimetre);
    error = error_of([&] { load_depth(view); });
    EXPECT_NE(error.find("another aspect ratio"), std::string::npos) << error;
}

TEST(Depths, of_other_sizes_are_interpolated_on_a_surface_and_kept_apart_at_edges) {
    const fs::path set = write_set(false);
    for (const int times : {1, 4}) {  // 4: of a pixel of the photo the middle
        write_depth_png(set / "depths/a.png", ramp(8 * times, 6 * times), 1e-4);
        View view = load_dataset(set).views[0];
        view.depth_unit = 1e-4;
        const ImageF depth = load_depth(view);
        for (int x = 1; x < 7; ++x) EXPECT_NEAR(depth.at(x, 3, 0), 1 + 0.01 * (x + 0.5) / 8, 1e-4);
    }
    ImageF edge(4, 3, 1);
    edge.data = {1, 1, 9, 9, 1, 1, 9, 9, 1, 1, 9, 0};
    write_depth_png(set / "depths/a.png", edge, kMillimetre);
    const ImageF depth = load_depth(load_dataset(set).views[0]);
    for (int x = 0; x < 8; ++x)
        EXPECT_EQ(depth.at(x, 2, 0), x < 4 ? 1 : 9) << "no mean of two surfaces";
    EXPECT_EQ(depth.at(7, 5, 0), 0) << "nothing was measured there";
}

TEST(Depths, are_straightened_with_the_photo) {
    const fs::path set = write_set(false, R"("k1": -0.2, )");
    write_depth_png(set / "depths/a.png", ramp(800, 600), 1e-4);
    View view = load_dataset(set).views[0];
    view.depth_unit = 1e-4;
    const ImageF depth = load_depth(view);
    const Camera& c = view.camera;
    for (int y = 0; y < c.height; ++y)
        for (int x = 0; x < c.width; ++x) {
            const double u = (x + 0.5 - c.cx) / c.fx, v = (y + 0.5 - c.cy) / c.fy;
            const double px = 4 + 10 * u * (1 - 0.2 * (u * u + v * v));
            EXPECT_NEAR(depth.at(x, y, 0), 1 + 0.01 * px / 8, 2e-4) << x << " " << y;
        }
}

TEST(Depths, of_a_picture_are_compared_in_metres_where_splats_are_and_something_was_measured) {
    ImageF rendered(4, 1, 2), measured(4, 1, 1);
    rendered.data = {5, 1, 7, 1, 9, 0.2f, 3, 1};  // depth in world units, opacity
    measured.data = {2, 3, 4, 0};                 // the third is not covered
    const std::optional<DepthError> error = compare_depth(rendered, measured, 2);
    ASSERT_TRUE(error);
    EXPECT_DOUBLE_EQ(error->mean_m, 0.5);
    EXPECT_DOUBLE_EQ(error->median_m, 0.5);
    measured.data = {0, 0, 0, 0};
    EXPECT_FALSE(compare_depth(rendered, measured, 2));
}

// World units that are not metres: points that a photo saw, at 2.5 times the measured depth.
TEST(Depths, the_scale_of_the_scene_follows_from_points_that_photos_saw) {
    const fs::path set = write_set(true);
    write_depth_png(set / "depths/a.png", ramp(8, 6), kMillimetre);
    Dataset dataset = load_dataset(set);
    for (int i = 0; i < 30; ++i) {
        const double z = i < 25 ? 2.5 : 7;  // some lie elsewhere
        const glm::dvec3 at((i % 6 - 2.5) * 0.1 * z, (i % 4 - 1.5) * 0.1 * z, z);
        for (int c = 0; c < 3; ++c) dataset.points.position.push_back(at[c]);
        dataset.points.colour.insert(dataset.points.colour.end(), 3, 128);
        dataset.points.seen_by.push_back(0);
        dataset.points.seen_begin.push_back(static_cast<std::size_t>(i));
    }
    dataset.points.seen_begin.push_back(30);
    find_depth_scale(dataset);
    EXPECT_NEAR(dataset.depth_scale, 2.5, 0.03);
    EXPECT_NE(dataset.notes.back().find("--depth-scale"), std::string::npos);
    EXPECT_FALSE(dataset.notes.back().starts_with("Warning:")) << dataset.notes.back();
    for (std::size_t i = 0; i < 90; i += 6)  // every other point lies behind what was measured
        for (std::size_t c = 0; c < 3; ++c) dataset.points.position[i + c] *= 2;
    find_depth_scale(dataset);
    EXPECT_TRUE(dataset.notes.back().starts_with("Warning: the depths do not fit the points."))
        << dataset.notes.back();
    dataset.options.depth_scale = 4;
    find_depth_scale(dataset);
    EXPECT_EQ(dataset.depth_scale, 4);
    dataset.options.depth_scale.reset();
    dataset.points.seen_begin.resize(11);
    dataset.points.colour.resize(30);
    EXPECT_NE(error_of([&] { find_depth_scale(dataset); }).find("only 10 points"),
              std::string::npos);
}

}  // namespace
}  // namespace darb
