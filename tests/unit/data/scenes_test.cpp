// SPDX-License-Identifier: MIT
// The real data sets load: counts, sizes, poses that see the points, and photos.
#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "engine/data/dataset.h"
#include "engine/data/depths.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

struct Scene {
    const char* folder;
    std::size_t views, tests, points;
    int width, height;
    bool alpha;
};

class RealScene : public testing::TestWithParam<Scene> {};

/// Share of the points before the camera and inside its frame.
double seen_share(const View& view, const PointCloud& points) {
    std::size_t seen = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double* at = &points.position[i * 3];
        const glm::dvec3 p =
            view.camera.rotation * glm::dvec3(at[0], at[1], at[2]) + view.camera.translation;
        if (!(p.z > 0)) continue;
        const double x = view.camera.fx * p.x / p.z + view.camera.cx;
        const double y = view.camera.fy * p.y / p.z + view.camera.cy;
        if (x >= 0 && y >= 0 && x <= view.camera.width && y <= view.camera.height) ++seen;
    }
    return static_cast<double>(seen) / static_cast<double>(points.size());
}

TEST_P(RealScene, load_has_documented_counts_and_sizes) {
    const Scene scene = GetParam();
    DARB_NEED_DATA(test_data() / scene.folder);
    DatasetOptions options;
    options.hold_out = true;
    const Dataset dataset = load_dataset(test_data() / scene.folder, options);
    EXPECT_EQ(dataset.views.size(), scene.views);
    EXPECT_EQ(dataset.points.size(), scene.points);
    EXPECT_EQ(dataset.has_alpha, scene.alpha);
    EXPECT_FALSE(dataset.alpha_is_mask);
    std::size_t tests = 0;
    for (const View& view : dataset.views) {
        EXPECT_EQ(view.camera.width, scene.width) << view.name;
        EXPECT_EQ(view.camera.height, scene.height) << view.name;
        EXPECT_GT(view.camera.fx, 0.3 * scene.width) << view.name;
        if (view.is_test) ++tests;
        if (scene.points > 0) {
            EXPECT_GT(seen_share(view, dataset.points), 0.1) << view.name;
        }
    }
    EXPECT_EQ(tests, scene.tests);
    EXPECT_TRUE(std::is_sorted(dataset.views.begin(), dataset.views.end(),
                               [](const View& a, const View& b) { return a.name < b.name; }));
    EXPECT_GT(scene_extent(dataset), 0.1);
}

TEST_P(RealScene, photos_match_their_cameras) {
    const Scene scene = GetParam();
    DARB_NEED_DATA(test_data() / scene.folder);
    Dataset dataset = load_dataset(test_data() / scene.folder);
    dataset.views.resize(3);
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    ASSERT_EQ(photos.size(), 3u);
    for (const ImageU8& photo : photos) {
        EXPECT_EQ(std::tie(photo.width, photo.height), std::tie(scene.width, scene.height));
        EXPECT_EQ(photo.channels, 4);
        int low_alpha = 255, high = 0;
        for (std::size_t i = 0; i < photo.data.size(); i += 4) {
            low_alpha = std::min<int>(low_alpha, photo.data[i + 3]);
            high = std::max<int>(high, photo.data[i]);
        }
        EXPECT_EQ(low_alpha, scene.alpha ? 0 : 255);
        EXPECT_GT(high, 100);
    }
}

INSTANTIATE_TEST_SUITE_P(
    AllScenes, RealScene,
    testing::Values(Scene{"fox_800", 50, 7, 13457, 449, 800, false},
                    Scene{"fox_200_tiny", 25, 4, 4000, 200, 356, false},
                    Scene{"monstree_800", 23, 3, 4876, 800, 601, false},
                    Scene{"monstree_200_tiny", 23, 3, 4000, 200, 150, false},
                    Scene{"miku_plush_800", 48, 6, 4767, 800, 597, false},
                    Scene{"miku_plush_200_tiny", 48, 6, 3000, 200, 149, false},
                    Scene{"sceaux_castle_800", 11, 2, 4799, 800, 594, false},
                    Scene{"sceaux_castle_200_tiny", 11, 2, 3000, 200, 149, false},
                    Scene{"lego_nerf_synthetic_400", 63, 11, 0, 400, 400, true},
                    Scene{"lego_nerf_synthetic_200_tiny", 37, 6, 0, 200, 200, true}),
    [](const auto& test) { return std::string(test.param.folder); });

TEST(FoxTransforms, original_file_skips_the_photos_that_are_missing) {
    const auto file = test_data() / "fox_800" / "transforms_instantngp_original_67.json";
    DARB_NEED_DATA(file);
    const Dataset dataset = load_dataset(file);
    EXPECT_EQ(dataset.views.size(), 50u);
    const auto has_note = [&](const std::string& text) {
        return std::any_of(
            dataset.notes.begin(), dataset.notes.end(),
            [&](const std::string& note) { return note.find(text) != std::string::npos; });
    };
    EXPECT_TRUE(has_note("17 frames"));
    EXPECT_TRUE(has_note("50 cameras were scaled"));
    EXPECT_EQ(dataset.views[0].lens.model, "OPENCV");
}

TEST(RealScenes, lego_cameras_look_at_the_model) {
    DARB_NEED_DATA(test_data() / "lego_nerf_synthetic_200_tiny");
    for (const View& view : load_dataset(test_data() / "lego_nerf_synthetic_200_tiny").views) {
        const Camera& camera = view.camera;
        EXPECT_NEAR(camera.translation.z, glm::length(camera.centre()), 0.2) << view.name;
        EXPECT_NEAR(glm::length(camera.centre()), 4.03, 0.01) << view.name;
        EXPECT_NEAR(camera.fx, 0.5 * 200 / std::tan(0.5 * 0.6911112070083618), 1e-9);
    }
}

TEST(RealScenes, folder_scaled_by_divisor_and_width) {
    DARB_NEED_DATA(test_data() / "monstree_200_tiny");
    DatasetOptions options;
    options.resolution = 4;
    const Dataset quarter = load_dataset(test_data() / "monstree_200_tiny", options);
    EXPECT_EQ(quarter.views[0].camera.width, 50);
    EXPECT_EQ(quarter.views[0].camera.height, 38);
    EXPECT_EQ(load_photo(quarter.views[0]).width, 50);
    options.resolution = 100;
    const Dataset hundred = load_dataset(test_data() / "monstree_200_tiny", options);
    EXPECT_EQ(hundred.views[0].camera.width, 100);
    EXPECT_EQ(hundred.views[0].camera.height, 75);
    EXPECT_DOUBLE_EQ(hundred.views[0].camera.fx * 2,
                     load_dataset(test_data() / "monstree_200_tiny").views[0].camera.fx);
    options.resolution = 20'000;  // wider than the photos: they stay, and it is said
    const Dataset wide = load_dataset(test_data() / "monstree_200_tiny", options);
    EXPECT_EQ(wide.views[0].camera.width, 200);
    EXPECT_TRUE(std::any_of(wide.notes.begin(), wide.notes.end(), [](const std::string& note) {
        return note.starts_with("-r 20000 is wider than");
    }));
}

/// A data set with something wrong, and a correct one with the same photos.
struct FaultCase {
    const char *set, *right;
    bool depths;
};

class ImportCase : public testing::TestWithParam<FaultCase> {};

INSTANTIATE_TEST_SUITE_P(
    Cases, ImportCase,
    testing::Values(FaultCase{"absolute_names/c_abs", "outlier_camera/t_ply", false},
                    FaultCase{"absolute_names/c_absu", "outlier_camera/t_ply", false},
                    FaultCase{"photos_in_root/c_flatimg", "outlier_camera/t_ply", false},
                    FaultCase{"photos_in_root/c_prefix", "outlier_camera/t_ply", false},
                    FaultCase{"mask_in_alpha/k_rgba2", "mask_in_alpha/k_same", false},
                    FaultCase{"masks_not_found/k_Masks", "mask_in_alpha/k_same", false},
                    FaultCase{"outlier_camera/t_plyfar", "outlier_camera/t_no3", false},
                    FaultCase{"tiff_depth/x_tif", "ngp_depth_scale/x_tmm", true},
                    FaultCase{"ngp_depth_scale/x_tngp", "ngp_depth_scale/x_tmm", true}),
    [](const auto& test) {
        std::string name = test.param.set;
        std::replace(name.begin(), name.end(), '/', '_');
        return name;
    });

// Photos, masks, depths and poses equal those of the correct set, and so do its pictures.
TEST_P(ImportCase, is_read_as_the_one_that_is_right) {
    const auto cases = test_data() / "cases";
    const FaultCase set = GetParam();
    DARB_NEED_DATA(cases / set.set);
    DARB_NEED_DATA(cases / set.right);
    const Dataset read = load_dataset(cases / set.set), right = load_dataset(cases / set.right);
    ASSERT_EQ(read.views.size(), right.views.size());
    for (std::size_t v = 0; v < read.views.size(); ++v) {
        const View &a = read.views[v], &b = right.views[v];
        EXPECT_EQ(a.photo.filename(), b.photo.filename());
        EXPECT_NEAR(glm::distance(a.camera.centre(), b.camera.centre()), 0, 1e-6);
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(glm::distance(a.camera.rotation[c], b.camera.rotation[c]), 0, 1e-6);
        EXPECT_EQ(a.camera.fx, b.camera.fx);
        EXPECT_EQ(load_photo(a).data, load_photo(b).data) << a.name;
        if (!set.depths) continue;
        const ImageF one = load_depth(a), two = load_depth(b);
        for (std::size_t p = 0; p < one.data.size(); ++p)
            ASSERT_NEAR(one.data[p], two.data[p], 0.0011) << a.name << " " << p;
    }
    EXPECT_NEAR(scene_extent(read), scene_extent(right), 1e-6);
}

}  // namespace
}  // namespace darb
