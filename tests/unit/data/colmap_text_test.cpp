// SPDX-License-Identifier: MIT
// COLMAP text models, and the real models in both forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <unordered_map>

#include "engine/core/files.h"
#include "engine/data/colmap.h"
#include "engine/data/lens_model.h"
#include "engine/data/point_cloud_ply.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

TEST(ColmapText, names_with_blanks_empty_lines_and_comments_are_read) {
    const auto images = parse_colmap_images_text(
        "# header\n\n1 1 0 0 0 1 2 3 7 a b.jpg\r\n\n2 0 2 0 0 4 5 6 8 c.jpg\n1 2 -1 3 4 5\n"
        "3 1 0 0 0 0 0 0 7 last.jpg",
        "images.txt");
    ASSERT_EQ(images.size(), 3u);
    EXPECT_EQ(images[0].name, "a b.jpg");
    EXPECT_EQ(images[1].translation, glm::dvec3(4, 5, 6));
    EXPECT_EQ(images[1].rotation[1], glm::dvec3(0, -1, 0)) << "half a turn about x";
    EXPECT_EQ(images[2].camera_id, 7u);
}

TEST(ColmapText, lines_of_observations_may_be_left_out_where_they_are_empty) {
    const auto images = parse_colmap_images_text(
        "1 1 0 0 0 1 2 3 7 a b.jpg\n2 1 0 0 0 4 5 6 7 b.jpg\n1 2 -1 3 4 5\n"
        "3 1 0 0 0 0 0 0 7 photo 12 of 30.jpg\n4 1 0 0 0 0 0 0 7 last.jpg",
        "images.txt");
    ASSERT_EQ(images.size(), 4u);
    EXPECT_EQ(images[1].name, "b.jpg");
    EXPECT_EQ(images[2].name, "photo 12 of 30.jpg");
    EXPECT_EQ(images[3].name, "last.jpg");
    const std::string error = error_of(
        [] { parse_colmap_images_text("1 1 0 0 0 1 2 3 7 a.jpg\n1 2 -1 3\n", "images.txt"); });
    EXPECT_NE(error.find("line 2"), std::string::npos) << error;
    EXPECT_NE(error.find("\n  "), std::string::npos) << error;
}

TEST(ColmapText, a_byte_order_mark_is_skipped) {
    const std::string mark = "\xef\xbb\xbf";
    std::size_t dropped = 0;
    EXPECT_EQ(parse_colmap_cameras_text(mark + "1 PINHOLE 8 6 50 50 4 3\n", "c").size(), 1u);
    EXPECT_EQ(parse_colmap_images_text(mark + "1 1 0 0 0 1 2 3 7 a\n\n", "i").size(), 1u);
    EXPECT_EQ(parse_colmap_points_text(mark + "1 0.5 0 0 1 2 3 0.1\n", "p", dropped).size(), 1u);
}

TEST(ColmapText, bad_lines_are_errors_that_name_them) {
    std::size_t dropped = 0;
    const auto cameras = [](const char* text) {
        return error_of([&] { parse_colmap_cameras_text(text, "cameras.txt"); });
    };
    EXPECT_NE(cameras("#\n1 PINHOLE 8 6 50").find("line 2"), std::string::npos);
    EXPECT_NE(cameras("1 PINHOLES 8 6 50 50 4 3").find("PINHOLES"), std::string::npos);
    EXPECT_NE(cameras("1 PINHOLE 8 6 0 50 4 3").find("focal"), std::string::npos);
    EXPECT_NE(cameras("1 PINHOLE 8 six 50 50 4 3").find("six"), std::string::npos);
    EXPECT_NE(error_of([&] {
                  parse_colmap_images_text("1 0 0 0 0 1 2 3 7 a\n", "i");
              }).find("quaternion"),
              std::string::npos);
    EXPECT_NE(
        error_of([&] { parse_colmap_images_text("1 1 0 0 0 nan 2 3 7 a\n", "i"); }).find("finite"),
        std::string::npos);
    EXPECT_NE(error_of([&] {
                  parse_colmap_points_text("1 0 0 0 1 2 300 0\n", "p", dropped);
              }).find("300"),
              std::string::npos);
    EXPECT_NE(error_of([&] { parse_colmap_images_text("1 1 0 0 0 1 2 3 7\n", "i"); }).find("\n  "),
              std::string::npos);
}

// A text cut at the end of a line is a shorter model; cut anywhere else, it may give an error, but
// never a crash.
TEST(ColmapText, truncated_anywhere_is_a_shorter_model_or_an_error) {
    const std::string cameras = "1 PINHOLE 8 6 50 50 4 3\n2 OPENCV 8 6 50 50 4 3 0.1 0 0 0\n",
                      images = "1 1 0 0 0 1 2 3 1 a.jpg\n1 2 -1\n2 1 0 0 0 1 2 3 2 b.jpg\n\n",
                      points = "1 0.5 0 0 1 2 3 0.1 1 2\n2 1 2 3 4 5 6 0 1 2\n";
    size_t errors = 0;
    const auto read = [&](const auto& parse) {
        try {
            EXPECT_LE(parse(), 2U);
        } catch (const Error& error) {
            EXPECT_EQ(error.where.find("cut.txt"), 0U) << error.where;
            ++errors;
        }
    };
    for (size_t length = 0; length < std::max({cameras.size(), images.size(), points.size()});
         ++length) {
        std::size_t dropped = 0;
        const auto part = [&](const std::string& text) { return text.substr(0, length); };
        read([&] { return parse_colmap_cameras_text(part(cameras), "cut.txt").size(); });
        read([&] { return parse_colmap_images_text(part(images), "cut.txt").size(); });
        read([&] { return parse_colmap_points_text(part(points), "cut.txt", dropped).size(); });
    }
    EXPECT_GT(errors, 50U);
}

TEST(ColmapText, nan_points_are_counted) {
    std::size_t dropped = 0;
    EXPECT_EQ(
        parse_colmap_points_text("1 0 nan 0 1 2 3 0\n2 1 2 3 4 5 6 0 1 2\n", "p", dropped).size(),
        1u);
    EXPECT_EQ(dropped, 1u);
}

TEST(RealModel, binary_and_text_agree) {
    const auto folder = test_data() / "fixtures" / "colmap_sceaux_opencv";
    DARB_NEED_DATA(folder);
    const ColmapModel binary = read_colmap(folder / "bin"), text = read_colmap(folder / "txt");
    EXPECT_TRUE(binary.binary);
    EXPECT_FALSE(text.binary);
    ASSERT_EQ(binary.cameras.size(), 1u);
    EXPECT_EQ(binary.cameras.at(1).model, "OPENCV");
    EXPECT_EQ(binary.cameras.at(1).parameters, text.cameras.at(1).parameters);
    ASSERT_EQ(binary.images.size(), 11u);
    ASSERT_EQ(text.images.size(), 11u);
    std::unordered_map<std::string, const ColmapImage*> by_name;
    for (const ColmapImage& image : text.images) by_name[image.name] = &image;
    for (const ColmapImage& image : binary.images) {
        EXPECT_NEAR(glm::length(image.translation - by_name.at(image.name)->translation), 0, 1e-12);
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(glm::length(image.rotation[c] - by_name.at(image.name)->rotation[c]), 0,
                        1e-12);
    }
    EXPECT_EQ(binary.points.size(), 1200u);
    EXPECT_EQ(text.points.size(), 1200u);
    const auto sum = [](const PointCloud& points) {
        double total = 0;
        for (const double value : points.position) total += value;
        for (const std::uint8_t value : points.colour) total += value;
        return total;
    };
    EXPECT_NEAR(sum(binary.points), sum(text.points), 1e-6);
    std::size_t dropped = 0;
    EXPECT_NEAR(sum(read_point_cloud_ply(folder / "points.ply", dropped)), sum(binary.points),
                1e-2);
}

TEST(RealModel, observations_lie_where_pose_and_lens_project_their_points) {
    const auto folder = test_data() / "fixtures" / "colmap_sceaux_opencv" / "txt";
    DARB_NEED_DATA(folder);
    const ColmapModel model = read_colmap(folder);
    const Lens lens(model.cameras.at(1));
    std::unordered_map<std::int64_t, glm::dvec3> points;
    std::istringstream point_lines(read_text_file(folder / "points3D.txt"));
    for (std::string line; std::getline(point_lines, line);) {
        std::istringstream words(line);
        std::int64_t id = 0;
        glm::dvec3 at;
        if (line[0] != '#' && words >> id >> at.x >> at.y >> at.z) points[id] = at;
    }
    std::istringstream image_lines(read_text_file(folder / "images.txt"));
    std::size_t image = 0, observations = 0;
    double error = 0;
    for (std::string line; std::getline(image_lines, line);) {
        if (line[0] == '#') continue;
        ASSERT_TRUE(std::getline(image_lines, line));
        std::istringstream words(line);
        glm::dvec2 seen;
        for (std::int64_t id = 0; words >> seen.x >> seen.y >> id;) {
            if (id < 0) continue;
            const glm::dvec3 p =
                model.images[image].rotation * points.at(id) + model.images[image].translation;
            error += glm::distance(lens.project({p.x / p.z, p.y / p.z}), seen);
            ++observations;
        }
        ++image;
    }
    EXPECT_EQ(observations, 8436u);
    EXPECT_LT(error / static_cast<double>(observations), 0.7) << "px of 2832 x 2128";
}

TEST(RealModel, points_in_binary_and_ply_agree) {
    const auto folder = test_data() / "fixtures" / "inria_miku_output";
    DARB_NEED_DATA(folder);
    std::size_t dropped = 0;
    const auto file = folder / "sparse_0_points3D.bin";
    const PointCloud binary = parse_colmap_points(read_file(file), file.string(), dropped);
    const PointCloud ply = read_point_cloud_ply(folder / "sparse_0_points3D.ply", dropped);
    EXPECT_EQ(binary.colour, ply.colour);
    ASSERT_EQ(binary.position.size(), ply.position.size());
    for (std::size_t i = 0; i < ply.position.size(); ++i)
        ASSERT_EQ(static_cast<float>(binary.position[i]), static_cast<float>(ply.position[i])) << i;
    const auto cameras = folder / "sparse_0_cameras.bin";
    EXPECT_EQ(parse_colmap_cameras(read_file(cameras), cameras.string()).size(), 1u);
}

TEST(RealModel, bonsai_with_three_images_is_read) {
    const auto folder = test_data() / "fixtures" / "colmap_bonsai_3img";
    DARB_NEED_DATA(folder);
    const ColmapModel model = read_colmap(folder);
    EXPECT_EQ(model.images.size(), 3u);
    EXPECT_EQ(model.points.size(), 1334u);
}

}  // namespace
}  // namespace darb
