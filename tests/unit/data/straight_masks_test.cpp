// SPDX-License-Identifier: MIT
// Masks of photos that COLMAP undistorted, checked against its lens written out.
#include "engine/data/masks.h"

#include <cmath>

#include "engine/core/files.h"
#include "engine/data/image_io.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 60, kHeight = 40;
constexpr double kFocal = 50, kRadial = -0.6;

/// What COLMAP leaves for a photo a.png taken with a lens: its models, and a pinhole of another
/// size.
ColmapRun straightened_set(const fs::path& folder) {
    const ColmapRun run{.photos = folder / "photos", .workspace = folder / "out"};
    write_png(run.photos / "a.png", ImageU8(kWidth, kHeight, 3));
    write_file_atomic(run.workspace / "sparse/0/cameras.txt",
                      std::string("1 SIMPLE_RADIAL 60 40 50 30 20 -0.6\n"));
    write_file_atomic(run.workspace / "dense/sparse/cameras.txt",
                      std::string("1 PINHOLE 50 32 50 50 25 16\n"));
    for (const char* model : {"sparse/0", "dense/sparse"})
        write_file_atomic(run.workspace / model / "images.txt",
                          std::string("1 1 0 0 0 0 0 0 1 a.png\n\n"));
    write_png(run.workspace / "dense/images/a.png", ImageU8(50, 32, 3));
    return run;
}

TEST(StraightMasks, follow_the_lens_to_the_pixel) {
    const ColmapRun run = straightened_set(test_folder());
    constexpr double kEdge = 47;  // px of the photo: white beyond
    ImageU8 mask(kWidth, kHeight, 1);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) mask.at(x, y, 0) = x >= kEdge ? 255 : 0;
    write_png(run.photos.parent_path() / "masks/a.png", mask);
    EXPECT_EQ(straighten_masks(run), 1u);
    const ImageU8 straight = read_image(run.workspace / "dense/masks/a.png.png", 1);
    ASSERT_EQ(straight.width, 50);
    ASSERT_EQ(straight.height, 32);
    int bent = 0;  // pixels on the other side of the edge than without a lens
    for (int y = 0; y < straight.height; ++y)
        for (int x = 0; x < straight.width; ++x) {
            const double u = (x + 0.5 - 25) / kFocal, v = (y + 0.5 - 16) / kFocal;
            const double px = 30 + kFocal * u * (1 + kRadial * (u * u + v * v));
            if (std::abs(px - kEdge) < 1) continue;
            EXPECT_EQ(straight.at(x, y, 0), px > kEdge ? 255 : 0) << x << " " << y;
            bent += (x + 0.5 + 5 > kEdge) != (px > kEdge) ? 1 : 0;
        }
    EXPECT_GT(bent, 3);
    // Made once; photos without one have none.
    fs::remove(run.workspace / "dense/masks/a.png.png");
    EXPECT_EQ(straighten_masks(run), 1u);
    EXPECT_FALSE(fs::exists(run.workspace / "dense/masks/a.png.png"));
}

}  // namespace
}  // namespace darb
