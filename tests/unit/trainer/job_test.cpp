// SPDX-License-Identifier: MIT
// What a request becomes beside its data set.
#include "trainer/job/job.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/core/files.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "trainer/growth/predicted_growth.h"
#include "trainer/options/schedule.h"

namespace darb {
namespace {

Dataset photos_of(int width, int height) {
    const std::filesystem::path root = std::filesystem::path(::testing::TempDir()) / "darb_job";
    nlohmann::json file{{"fl_x", width}, {"w", width}, {"h", height}};
    for (int i = 0; i < 3; ++i) {
        const std::string name = std::to_string(i) + ".png";
        write_png(root / name, ImageU8(width, height, 3));
        file["frames"].push_back(
            {{"file_path", name},
             {"transform_matrix", {{1, 0, 0, 0.1 * i}, {0, 1, 0, 0}, {0, 0, 1, 4}, {0, 0, 0, 1}}}});
    }
    write_file_atomic(root / "transforms.json", file.dump());
    return load_dataset(root);
}

TrainOptions resolved(TrainOptions options, int width, int height) {
    TrainRequest request;
    request.train = options;
    return resolve(request, photos_of(width, height), {}, false).options;
}

TEST(Job, large_photos_have_more_weight_for_ssim) {
    EXPECT_FLOAT_EQ(resolved({}, 400, 300).dssim_weight(), 0.2f);
    EXPECT_FLOAT_EQ(resolved({}, 799, 500).dssim_weight(), 0.2f);
    EXPECT_FLOAT_EQ(resolved({}, 800, 500).dssim_weight(), 0.3f);
    TrainOptions given;
    given.lambda_dssim = 0.2f;
    EXPECT_FLOAT_EQ(resolved(given, 1600, 1064).dssim_weight(), 0.2f);
    TrainOptions published;
    use_3dgs_schedule(published);
    EXPECT_FLOAT_EQ(resolved(published, 1600, 1064).dssim_weight(), 0.2f);
    // Without a job it is that of 3DGS.
    EXPECT_FLOAT_EQ(TrainOptions{}.dssim_weight(), 0.2f);
}

TEST(Job, more_weight_for_ssim_is_forecast_to_bring_more_splats) {
    GrowthStart start{.splats = 4'000, .photo_pixels = 3'000'000, .limit = 4'000'000'000u};
    start.detail = {0.05, 1};
    start.photos = 20;
    start.scene_pixels = 1e6;
    TrainOptions more;
    more.lambda_dssim = 0.3f;
    const double few = predict_splats(Schedule(), start), many = predict_splats(more, start);
    EXPECT_GT(few, 4'000);
    EXPECT_NEAR(many / few, 1.3, 0.01);
}

}  // namespace
}  // namespace darb
