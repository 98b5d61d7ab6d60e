// SPDX-License-Identifier: MIT
// Panoramas without cameras: the views that COLMAP gets of them, and what becomes of its answer.
#include "engine/data/panorama_cameras.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

#include "engine/core/files.h"
#include "engine/data/colmap.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

constexpr int kSide = 20;  // px of a view: 64 px over pi

glm::dmat3 turned(double degrees, const glm::dvec3& axis) {
    return glm::mat3_cast(glm::angleAxis(glm::radians(degrees), glm::normalize(axis)));
}

PanoramaPose pose_at(const glm::dmat3& rotation, const glm::dvec3& centre) {
    return {rotation, -(rotation * centre), 1};
}

TEST(PanoramaCameras, views_stand_around_the_horizon) {
    for (std::size_t v = 0; v < kPanoramaViews; ++v) {
        const glm::dmat3& r = panorama_views()[v].rotation;
        EXPECT_NEAR(glm::determinant(r), 1, 1e-12);
        const glm::dvec3 ahead = glm::transpose(r) * glm::dvec3(0, 0, 1);
        const double angle = std::numbers::pi / 3 * double(v);
        EXPECT_NEAR(glm::distance(ahead, {std::sin(angle), 0, std::cos(angle)}), 0, 1e-12) << v;
        EXPECT_NEAR(glm::distance(glm::transpose(r) * glm::dvec3(0, 1, 0), {0, 1, 0}), 0, 1e-12);
        EXPECT_EQ(panorama_views()[v].name, fmt::format("{:03d}", 60 * v));
    }
}

TEST(PanoramaCameras, most_views_decide_and_their_mean_counts) {
    const glm::dmat3 r = turned(170, {1, 2, 3});
    std::vector<PanoramaPose> said{pose_at(turned(0.5, {0, 1, 0}) * r, {1.01, 2, 3}),
                                   pose_at(turned(-0.5, {0, 1, 0}) * r, {0.99, 2, 3}),
                                   pose_at(turned(40, {0, 1, 0}) * r, {1, 2, 3}),
                                   pose_at(r, {5, 2, 3})};
    const auto agreed = agreed_pose(said, 0.1);
    ASSERT_TRUE(agreed);
    EXPECT_EQ(agreed->agree, 2U);
    EXPECT_NEAR(glm::distance(agreed->centre(), {1, 2, 3}), 0, 1e-9);
    for (glm::length_t c = 0; c < 3; ++c)
        EXPECT_NEAR(glm::distance(agreed->rotation[c], r[c]), 0, 1e-6);
    EXPECT_FALSE(agreed_pose({}, 0.1));
}

TEST(PanoramaCameras, neighbours_and_farther_ones_are_compared) {
    EXPECT_EQ(panorama_pairs(5, false).size(), 10U);
    std::vector<std::size_t> from_first;
    for (const auto& [first, second] : panorama_pairs(20, true))
        if (first == 0) from_first.push_back(second);
    EXPECT_EQ(from_first, (std::vector<std::size_t>{1, 2, 3, 4, 8, 16}));
}

/// Three panoramas, and a stand-in for colmap whose model has their views, of which one is wrong.
class PanoramaFolder : public testing::Test {
  protected:
    void SetUp() override {
        for (std::size_t p = 0; p < 3; ++p) {
            poses_[p] = pose_at(turned(25.0 * double(p), {0.2, 1, 0}), {double(p), 0.1, 0});
            ImageU8 photo(64, 32, 3);
            for (std::size_t i = 0; i < photo.data.size(); ++i)
                photo.data[i] = static_cast<std::uint8_t>(40 * p + i % 64);
            write_png(folder_ / "photos" / name(p), photo);
        }
        write_model();
        write_file_atomic(folder_ / "bin/colmap",
                          fmt::format("#!/bin/sh\n[ \"$2\" = -h ] && exit\necho $* >> '{0}/calls'\n"
                                      "if [ $1 = mapper ]; then cp -r '{0}/model' \"$7/0\"; fi\n",
                                      folder_.string()));
        std::filesystem::permissions(folder_ / "bin/colmap", std::filesystem::perms::owner_all);
        setenv("PATH", ((folder_ / "bin").string() + ":" + old_).c_str(), 1);
    }
    void TearDown() override { setenv("PATH", old_.c_str(), 1); }

    static std::string name(std::size_t p) { return fmt::format("room_{}.png", p); }
    ColmapRun run() const { return {.photos = folder_ / "photos", .workspace = folder_ / "work"}; }
    std::filesystem::path find(const ColmapRun& run) const {
        return find_panorama_cameras(run, {name(0), name(1), name(2)}, {});
    }

    void write_model() const {
        write_file_atomic(folder_ / "model/cameras.txt",
                          fmt::format("1 PINHOLE {0} {0} {1} {1} {1} {1}\n", kSide, kSide / 2));
        const glm::dvec3 point(4, 1, 9);
        std::string images, track;
        int id = 0;
        for (std::size_t p = 0; p < 3; ++p)
            for (std::size_t v = 0; v < 3; ++v) {
                const glm::dmat3& turn = panorama_views()[v].rotation;
                glm::dmat3 rotation = turn * poses_[p].rotation;
                const glm::dvec3 translation = turn * poses_[p].translation;
                const glm::dvec3 seen = rotation * point + translation;
                if (p == 1 && v == 2) rotation = turned(30, {0, 0, 1}) * rotation;
                const glm::dquat q = glm::quat_cast(rotation);
                images += fmt::format(
                    "{} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} "
                    "1 room_{}@{}.jpg\n",
                    ++id, q.w, q.x, q.y, q.z, translation.x, translation.y, translation.z, p,
                    panorama_views()[v].name);
                const glm::dvec2 at(kSide / 2 * (seen.x / seen.z + 1),
                                    kSide / 2 * (seen.y / seen.z + 1));
                const bool inside = seen.z > 0 && at.x > 0 && at.x < kSide;
                images += inside ? fmt::format("{:.9g} {:.9g} 1\n", at.x, at.y) : "\n";
                if (inside) track += fmt::format(" {} 0", id);
            }
        write_file_atomic(folder_ / "model/images.txt", images);
        write_file_atomic(folder_ / "model/points3D.txt", "1 4 1 9 10 20 30 0.5" + track + "\n");
    }

    std::array<PanoramaPose, 3> poses_;
    std::filesystem::path folder_ = test_folder();
    std::string old_ = std::getenv("PATH");
};

TEST_F(PanoramaFolder, becomes_a_data_set_with_the_poses_of_its_views) {
    const auto data_set = find(run());
    DatasetOptions whole;
    whole.whole_panoramas = true;
    whole.require_photos = false;
    const Dataset cameras = load_dataset(data_set, whole);
    ASSERT_EQ(cameras.views.size(), 3U);
    for (std::size_t p = 0; p < 3; ++p) {
        EXPECT_EQ(cameras.views[p].name, name(p));
        EXPECT_NEAR(glm::distance(cameras.views[p].camera.centre(), poses_[p].centre()), 0, 1e-9);
        for (glm::length_t c = 0; c < 3; ++c)
            EXPECT_NEAR(glm::distance(cameras.views[p].camera.rotation[c], poses_[p].rotation[c]),
                        0, 1e-9)
                << "the view that contradicts the others does not count";
    }
    const Dataset dataset = load_dataset(data_set);
    EXPECT_EQ(dataset.views.size(), 18U) << "six faces of each";
    ASSERT_EQ(dataset.points.size(), 1U);
    EXPECT_EQ(dataset.points.seen_by.size(), 3U) << "once by each, though two views overlap there";
    EXPECT_EQ(load_photo(dataset.views[0]).width, kSide);
    // Each observation is where its panorama sees the point.
    const ColmapModel model = read_colmap(data_set / "sparse");
    for (std::size_t p = 0; p < 3; ++p) {
        ASSERT_EQ(model.images[p].observed.size(), 2U);
        const glm::dvec2 expected = panorama_pixel(
            poses_[p].rotation * glm::dvec3(4, 1, 9) + poses_[p].translation, 64, 32);
        EXPECT_NEAR(model.images[p].observed[0], expected.x, 1e-3) << p;
        EXPECT_NEAR(model.images[p].observed[1], expected.y, 1e-3) << p;
    }
}

TEST_F(PanoramaFolder, colmap_takes_the_views_as_known_pinholes_and_compares_listed_pairs) {
    find(run());
    const std::string calls = read_text_file(folder_ / "calls");
    for (const char* part : {"camera_model PINHOLE", "camera_params 10,10,10,10",
                             "matches_importer", "match_type pairs", "ba_refine_focal_length 0"})
        EXPECT_NE(calls.find(part), std::string::npos) << part << " in\n" << calls;
    EXPECT_EQ(calls.find("image_undistorter"), std::string::npos);
    const std::string pairs = read_text_file(folder_ / "work/views/pairs.txt");
    EXPECT_EQ(std::ranges::count(pairs, '\n'), 3 * 6 + 3 * 36) << "within panoramas and between";
    EXPECT_NE(pairs.find("room_0@300.jpg room_0@000.jpg"), std::string::npos);
    const ImageU8 view = read_image(folder_ / "work/views/photos/room_2@060.jpg");
    EXPECT_EQ(view.width, kSide);
    // What is there is used again.
    find(run());
    EXPECT_EQ(read_text_file(folder_ / "calls"), calls);
}

TEST_F(PanoramaFolder, masks_are_cut_for_colmap_and_kept_for_training) {
    ImageU8 mask(64, 32, 1);
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 32; ++x) mask.at(x, y, 0) = 255;  // the right half is left out
    write_png(folder_ / "masks" / name(1), mask);
    ColmapRun with = run();
    with.masks = folder_ / "masks";
    const auto data_set = find(with);
    const ImageU8 left = read_image(folder_ / "work/views/masks/room_1@300.jpg.png"),
                  right = read_image(folder_ / "work/views/masks/room_1@060.jpg.png");
    EXPECT_EQ(left.at(kSide / 2, kSide / 2, 0), 255);
    EXPECT_EQ(right.at(kSide / 2, kSide / 2, 0), 0);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "work/views/masks/room_0@300.jpg.png"));
    std::size_t masked = 0;
    for (const View& view : load_dataset(data_set).views) masked += view.mask.empty() ? 0 : 1;
    EXPECT_EQ(masked, 6U);
}

TEST_F(PanoramaFolder, what_cannot_be_a_panorama_is_refused) {
    write_png(folder_ / "photos" / name(1), ImageU8(60, 32, 3));
    EXPECT_NE(error_of([&] { find(run()); }).find("60 x 32"), std::string::npos);
    setenv("PATH", (folder_ / "nothing").string().c_str(), 1);
    EXPECT_NE(error_of([&] { find(run()); }).find("apt install colmap"), std::string::npos);
}

}  // namespace
}  // namespace darb
