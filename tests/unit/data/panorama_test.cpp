// SPDX-License-Identifier: MIT
// Panoramas as photos of a data set, and as files for viewers of panoramas.
#include "engine/scene/panorama.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <set>

#include "engine/core/files.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "engine/data/panorama_files.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

/// 64 x 32 px: every face has a colour of its own.
ImageU8 six_colours() {
    ImageU8 panorama(64, 32, 3);
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 64; ++x) {
            const glm::dvec3 d = panorama_direction({x + 0.5, y + 0.5}, 64, 32);
            for (std::size_t f = 0; f < cube_faces().size(); ++f) {
                const glm::dvec3 p = cube_faces()[f].rotation * d;
                if (p.z >= std::abs(p.x) && p.z >= std::abs(p.y))
                    for (int c = 0; c < 3; ++c)
                        panorama.at(x, y, c) =
                            static_cast<std::uint8_t>(40 * f + 10 * static_cast<std::size_t>(c));
            }
        }
    return panorama;
}

void write_colmap(const std::filesystem::path& folder, const std::string& camera) {
    write_png(folder / "images/a.png", six_colours());
    write_png(folder / "images/b.png", six_colours());
    write_file_atomic(folder / "sparse/0/cameras.txt", camera);
    // b stands at (1, 0, 0), turned by a quarter about y: its x axis is the world's z.
    write_file_atomic(folder / "sparse/0/images.txt",
                      "1 1 0 0 0 0 0 0 1 a.png\n40 16 1 10 16 2\n"
                      "2 0.70710678118654752 0 0.70710678118654752 0 0 0 1 1 b.png\n20 16 1\n");
    write_file_atomic(folder / "sparse/0/points3D.txt",
                      "1 5 0 0.5 200 100 50 0.1 1 0 2 0\n2 -4 0 0 9 9 9 0.1 1 1\n");
}

constexpr const char* kPanoramas = "1 EQUIRECTANGULAR 64 32 64 32\n";

TEST(PanoramaSource, each_panorama_becomes_six_views_with_the_tracks_of_its_points) {
    const auto folder = test_folder();
    write_colmap(folder, kPanoramas);
    const Dataset dataset = load_dataset(folder);
    ASSERT_EQ(dataset.views.size(), 12U);
    std::set<std::string> names;
    for (const View& view : dataset.views) {
        names.insert(view.name);
        EXPECT_EQ(view.camera.width, 20) << "64 px over pi";
        EXPECT_EQ(view.camera.fx, 10);
        EXPECT_FALSE(view.camera.lens.active);
        const ImageU8 photo = load_photo(view);
        ASSERT_EQ(photo.width, 20);
        EXPECT_EQ(photo.at(10, 10, 0), 40 * view.face) << view.name;
        // -R^T t of the two images.
        const glm::dvec3 centre = view.name[0] == 'a' ? glm::dvec3(0) : glm::dvec3(1, 0, 0);
        EXPECT_NEAR(glm::distance(view.camera.centre(), centre), 0, 1e-6) << view.name;
    }
    EXPECT_TRUE(names.contains("a@front.png"));
    EXPECT_TRUE(names.contains("b@up.png"));
    // The first point is to the right of a; b sees it in another face. The second is to its left.
    const PointCloud& points = dataset.points;
    ASSERT_EQ(points.seen_begin, (std::vector<std::size_t>{0, 2, 3}));
    for (std::size_t p = 0; p < 2; ++p)
        for (std::size_t k = points.seen_begin[p]; k < points.seen_begin[p + 1]; ++k) {
            const Camera& c = dataset.views[points.seen_by[k]].camera;
            const double* at = &points.position[3 * p];
            const glm::dvec3 seen = c.rotation * glm::dvec3(at[0], at[1], at[2]) + c.translation;
            EXPECT_GE(seen.z, std::abs(seen.x)) << p;
            EXPECT_GE(seen.z, std::abs(seen.y)) << p;
        }
    EXPECT_EQ(dataset.views[points.seen_by[0]].name, "a@right.png");
    EXPECT_EQ(dataset.views[points.seen_by[2]].name, "a@left.png");
    bool said = false;
    for (const std::string& note : dataset.notes)
        said |= note.find("six faces of a cube at load: 2 panoramas") != std::string::npos;
    EXPECT_TRUE(said);
}

TEST(PanoramaSource, all_faces_of_a_panorama_are_held_out_together) {
    const auto folder = test_folder();
    write_colmap(folder, kPanoramas);
    DatasetOptions options;
    options.hold_out = true;
    options.held_out.every = 2;
    for (const View& view : load_dataset(folder, options).views)
        EXPECT_EQ(view.is_test, view.name[0] == 'a') << view.name;
}

TEST(PanoramaSource, resolution_masks_and_whole_panoramas) {
    const auto folder = test_folder();
    write_colmap(folder, kPanoramas);
    ImageU8 mask(64, 32, 1);
    std::fill(mask.data.begin(), mask.data.end(), std::uint8_t{255});
    for (int y = 24; y < 32; ++y)
        for (int x = 0; x < 64; ++x) mask.at(x, y, 0) = 0;  // the tripod
    write_png(folder / "masks/a.png", mask);
    DatasetOptions half;
    half.resolution = 2;
    for (const View& view : load_dataset(folder, half).views) {
        const ImageU8 photo = load_photo(view);
        ASSERT_EQ(photo.width, 10);
        EXPECT_EQ(photo.at(5, 5, 3), view.name == "a@down.png" ? 0 : 255) << view.name;
    }
    DatasetOptions whole;
    whole.require_photos = false;
    whole.whole_panoramas = true;
    const Dataset cameras = load_dataset(folder, whole);
    ASSERT_EQ(cameras.views.size(), 2U);
    EXPECT_EQ(cameras.views[0].camera.width, 64);
    EXPECT_EQ(cameras.views[0].camera.height, 32);
}

TEST(PanoramaSource, nerfstudio_panoramas_need_no_focal_length) {
    const auto folder = test_folder();
    write_png(folder / "images/a.png", six_colours());
    const auto file = [&](const std::string& more) {
        write_file_atomic(folder / "transforms.json",
                          "{\"camera_model\": \"EQUIRECTANGULAR\"" + more +
                              R"(, "frames": [{"file_path": "images/a.png",
                  "transform_matrix": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}]})");
    };
    file("");
    const Dataset dataset = load_dataset(folder);
    ASSERT_EQ(dataset.views.size(), 6U);
    for (const View& view : dataset.views)
        if (view.name == "images/a@front.png") {
            EXPECT_EQ(load_photo(view).at(10, 10, 0), 80);
            // OpenGL's camera looks along -z, with y up.
            EXPECT_NEAR(glm::distance(view.camera.rotation * glm::dvec3(0, 0, -1), {0, 0, 1}), 0,
                        1e-12);
        }
    file(", \"cx\": 20");
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("is not the middle"), std::string::npos);
}

TEST(PanoramaSource, a_part_of_a_panorama_is_refused) {
    const auto folder = test_folder();
    write_colmap(folder, "1 EQUIRECTANGULAR 64 20 64 20\n");
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("twice as wide as high"),
              std::string::npos);
    write_colmap(folder, "1 EQUIRECTANGULAR 64 32 60 32\n");
    EXPECT_NE(error_of([&] { load_dataset(folder); }).find("parameters say 60 x 32"),
              std::string::npos);
}

TEST(PanoramaFiles, a_png_says_that_it_is_one_and_stays_a_png) {
    const ImageU8 picture = six_colours();
    const std::vector<std::byte> file = encode_panorama_png(picture);
    const ImageU8 back = decode_image(file, "panorama");
    EXPECT_EQ(back.data, picture.data);
    const std::string text(reinterpret_cast<const char*>(file.data()), file.size());
    EXPECT_NE(text.find("GPano:ProjectionType=\"equirectangular\""), std::string::npos);
    EXPECT_NE(text.find("GPano:FullPanoWidthPixels=\"64\""), std::string::npos);
}

TEST(PanoramaFiles, ffprobe_reads_the_mark_of_a_video) {
    if (std::system("command -v ffmpeg ffprobe >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "ffmpeg is not installed";
    const auto folder = test_folder();
    write_png(folder / "frame_00000.png", six_colours());
    const std::string video = (folder / "video.mp4").string();
    ASSERT_EQ(std::system(fmt::format("ffmpeg -nostdin -loglevel error -i {} -pix_fmt yuv420p {}",
                                      (folder / "frame_00000.png").string(), video)
                              .c_str()),
              0);
    const auto probe = [&] {
        const std::string out = (folder / "probe.txt").string();
        EXPECT_EQ(
            std::system(fmt::format("ffprobe -v error -show_streams {} > {}", video, out).c_str()),
            0);
        return read_text_file(out);
    };
    EXPECT_EQ(probe().find("equirectangular"), std::string::npos);
    mark_panorama_video(video);
    EXPECT_NE(probe().find("equirectangular"), std::string::npos) << probe();
    EXPECT_NO_THROW(mark_panorama_video(video)) << "the lengths of its boxes still add up";
    write_file_atomic(folder / "no.mp4", std::string_view("not a video"));
    EXPECT_THROW(mark_panorama_video(folder / "no.mp4"), Error);
}

TEST(PanoramaFiles, photos_and_videos_say_that_they_are_panoramas) {
    const auto folder = test_folder();
    EXPECT_TRUE(is_marked_panorama(encode_panorama_png(six_colours())));
    EXPECT_FALSE(is_marked_panorama(encode_png(six_colours())));
    const auto marked = [&](std::string_view xmp) {
        return is_marked_panorama(std::as_bytes(std::span(xmp)));
    };
    EXPECT_TRUE(marked("<GPano:ProjectionType>equirectangular</GPano:ProjectionType>"));
    EXPECT_FALSE(marked("<GPano:ProjectionType>cylindrical</GPano:ProjectionType>"));
    const auto video = [&](const std::string& index) {
        std::string file(
            "\0\0\0\x10"
            "ftypisom\0\0\0\0\0\0\0\x0c"
            "mdatabcd",
            28);
        const auto size = static_cast<char>(8 + index.size());
        write_file_atomic(folder / "v.mp4",
                          file + std::string("\0\0\0", 3) + size + "moov" + index);
        return is_marked_panorama_video(folder / "v.mp4");
    };
    EXPECT_TRUE(video("uuid <GSpherical:ProjectionType>equirectangular<"));
    EXPECT_TRUE(video("trak sv3d prhd equi"));
    EXPECT_FALSE(video("trak equi"));
    EXPECT_FALSE(is_marked_panorama_video(folder / "missing.mp4"));
    write_file_atomic(folder / "v.mp4", std::string("no video at all, and long enough"));
    EXPECT_FALSE(is_marked_panorama_video(folder / "v.mp4"));
}

}  // namespace
}  // namespace darb
