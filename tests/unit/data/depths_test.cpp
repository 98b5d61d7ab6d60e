// Measured depths beside the photos: files, names, sizes, lenses, the scale of a scene.
#include "engine/data/depths.h"

#include <cmath>
#include <limits>

#include "engine/core/files.h"
#include "engine/data/colmap_write.h"
#include "engine/data/compare_view.h"
#include "engine/data/depth_io.h"
#include "engine/data/image_io.h"
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

/// Photos a.png and b.png of 8 x 6 px, a COLMAP model of them or a transforms file.
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

TEST(Depths, without_a_photo_or_of_another_shape_are_refused) {
    const fs::path set = write_set(false);
    write_depth_png(set / "depths/c.png", ramp(8, 6), kMillimetre);
    std::string error = error_of([&] { load_dataset(set); });
    EXPECT_NE(error.find("c.png: is the depth of no photo"), std::string::npos) << error;
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

// World units that no metre is: points that a photo saw, at 2.5 times what was measured.
TEST(Depths, the_scale_of_the_scene_follows_from_points_that_photos_saw) {
    const fs::path set = write_set(true);
    write_depth_png(set / "depths/a.png", ramp(8, 6), kMillimetre);
    Dataset dataset = load_dataset(set);
    for (int i = 0; i < 30; ++i) {
        const double z = i < 20 ? 2.5 : 7;  // some lie elsewhere
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
