// SPDX-License-Identifier: MIT
// The passes of exposure by a grid of maps against a picture in double and its finite differences.
#include "engine/core/rng.h"
#include "shaders/shared/effect_args.h"
#include "shaders/shared/render_args.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/shared_device.h"
#include "trainer/step/exposure.h"

namespace darb::test {
namespace {

constexpr std::uint32_t kPhotoWidth = 37, kPhotoHeight = 23, kPixels = kPhotoWidth * kPhotoHeight;
constexpr int kSides[3] = {EXPOSURE_GRID_X, EXPOSURE_GRID_Y, EXPOSURE_GRID_L};
constexpr ExposureMaps kMaps{2, true};
constexpr double kLightBehind[3] = {0.9, 0.2, 0.6};

/// A picture of the splats, how much of the background shows, a gradient, and two grids.
struct Case {
    std::vector<double> colours, open, d, maps;
};

Case random_case() {
    Pcg32 random(5);
    Case c;
    for (std::uint32_t i = 0; i < kPixels; ++i) c.open.push_back(0.5 * random.uniform());
    for (std::uint32_t i = 0; i < 3 * kPixels; ++i) {
        c.colours.push_back(random.uniform(-0.1, 1.2));  // luminances beyond both ends, too
        c.d.push_back(random.uniform(-1.0, 1.0));
    }
    for (std::size_t i = 0; i < kMaps.photos * kMaps.terms(); ++i)
        c.maps.push_back(kIdentityColours[i % 12] + random.uniform(-0.3, 0.3));
    return c;
}

/// [3] of pixel p as photo 1 shows it: a sum over all vertices of hats.
std::array<double, 3> mapped(const Case& c, std::uint32_t p) {
    std::array<double, 3> x{}, sum{};
    for (std::size_t k = 0; k < 3; ++k) x[k] = c.colours[k * kPixels + p];
    const double light = std::clamp(0.299 * x[0] + 0.587 * x[1] + 0.114 * x[2], 0.0, 1.0);
    const double at[3] = {(p % kPhotoWidth + 0.5) / kPhotoWidth * (kSides[0] - 1),
                          (p / kPhotoWidth + 0.5) / kPhotoHeight * (kSides[1] - 1),
                          light * (kSides[2] - 1)};
    for (int v = 0; v < EXPOSURE_GRID_VERTICES; ++v) {
        const int vertex[3] = {v % kSides[0], v / kSides[0] % kSides[1], v / kSides[0] / kSides[1]};
        double weight = 1;
        for (int axis = 0; axis < 3; ++axis)
            weight *= std::max(0.0, 1 - std::abs(at[axis] - vertex[axis]));
        const double* m = &c.maps[kMaps.terms() + static_cast<std::size_t>(v) * 12];
        for (std::size_t r = 0; r < 3; ++r)
            sum[r] += weight * (m[4 * r] * x[0] + m[4 * r + 1] * x[1] + m[4 * r + 2] * x[2] +
                                m[4 * r + 3] * (1 - c.open[p]));
    }
    for (std::size_t r = 0; r < 3; ++r) sum[r] += c.open[p] * kLightBehind[r];
    return sum;
}

/// The loss whose gradient is d at one pixel, plus the smoothness of `maps`.
double loss_at(const Case& c, std::uint32_t p) {
    const auto value = mapped(c, p);
    double sum = 0;
    for (std::size_t r = 0; r < 3; ++r) sum += c.d[r * kPixels + p] * value[r];
    return sum;
}

double whole_loss(const Case& c) {
    double sum = 0;
    for (std::uint32_t p = 0; p < kPixels; ++p) sum += loss_at(c, p);
    const int steps[3] = {1, kSides[0], kSides[0] * kSides[1]};
    for (int v = 0; v < EXPOSURE_GRID_VERTICES; ++v)
        for (int axis = 0; axis < 3; ++axis)
            if (v / steps[axis] % kSides[axis] + 1 < kSides[axis])
                for (int k = 0; k < 12; ++k) {
                    const auto at = [&](int vertex) {
                        return c.maps[kMaps.terms() + static_cast<std::size_t>(vertex * 12 + k)];
                    };
                    const double apart = at(v + steps[axis]) - at(v);
                    sum += 0.5 * EXPOSURE_GRID_SMOOTHNESS * apart * apart;
                }
    return sum;
}

std::vector<float> floats(const std::vector<double>& values) {
    return {values.begin(), values.end()};
}

struct GridRun {
    std::vector<float> mapped, d_image, d_maps, state;
};

GridRun run_grid(const Case& c) {
    Device& device = shared_device();
    Exposure exposure(device, kMaps, kPixels);
    std::vector<float> start = floats(c.maps);
    start.resize(kMaps.state_size());
    exposure.restore(start);
    std::vector<double> image = c.colours;  // over the background
    for (std::size_t i = 0; i < image.size(); ++i)
        image[i] += c.open[i % kPixels] * kLightBehind[i / kPixels];
    Buffer colours(device, "image", image.size() * 4), d(device, "d_image", kPixels * 16),
        transmittance(device, "transmittance", kPixels * 4),
        status(device, "status", sizeof(gpu::FrameStatus));
    colours.upload(floats(image));
    transmittance.upload(floats(c.open));
    d.upload(floats(c.d));
    status.upload(std::vector<gpu::FrameStatus>(1));
    const ExposedPicture picture{
        colours, transmittance, {kLightBehind[0], kLightBehind[1], kLightBehind[2]}, kPhotoWidth};
    Commands commands(device);
    commands.begin();
    exposure.record(commands, picture, 1, kPixels);
    exposure.record_backward(commands, picture, d, {1, kPixels, 0.01f, 1});
    exposure.record_step(commands, status, {1, kPixels, 0.01f, 1});
    commands.submit_and_wait();
    return {exposure.mapped().download<float>(3 * kPixels), d.download<float>(4 * kPixels),
            exposure.gradient(0), exposure.state()};
}

TEST(ExposureGrid, pictures_match_double) {
    const Case c = random_case();
    std::vector<double> expected(3 * kPixels);
    for (std::uint32_t p = 0; p < kPixels; ++p)
        for (std::size_t r = 0; r < 3; ++r) expected[r * kPixels + p] = mapped(c, p)[r];
    EXPECT_TRUE(compare("mapped", expected, run_grid(c).mapped, tolerance("projection_float32")));
}

// Gradients by the colours, away from the kinks where a luminance passes from one cell of the grid
// to the next.
TEST(ExposureGrid, gradients_of_the_picture_match_finite_differences) {
    Case c = random_case();
    const GridRun got = run_grid(c);
    constexpr double kStep = 1e-6;
    std::vector<double> expected, found;
    for (std::uint32_t p = 0; p < kPixels; ++p) {
        const double light = 0.299 * c.colours[p] + 0.587 * c.colours[kPixels + p] +
                             0.114 * c.colours[2 * kPixels + p];
        const double cell = light * (kSides[2] - 1);
        if (std::abs(cell - std::round(cell)) < 1e-3) continue;
        const auto slope = [&](double& value) {
            const double was = value;
            value = was + kStep;
            const double above = loss_at(c, p);
            value = was - kStep;
            const double below = loss_at(c, p);
            value = was;
            return (above - below) / (2 * kStep);
        };
        double behind = 0;  // what the picture's gradient has for the background
        for (std::size_t k = 0; k < 3; ++k) {
            const double d_colour = slope(c.colours[k * kPixels + p]);
            expected.push_back(d_colour);
            found.push_back(double{got.d_image[k * kPixels + p]});
            behind += d_colour * kLightBehind[k];
        }
        // The last plane: dL/d(1 - open) beside that.
        expected.push_back(behind - slope(c.open[p]));
        found.push_back(double{got.d_image[3 * kPixels + p]});
    }
    EXPECT_GT(expected.size(), 3 * kPixels);
    EXPECT_TRUE(compare_scaled("d_image", expected, found, tolerance("gradient_scaled_float32")));
}

TEST(ExposureGrid, gradients_of_the_grid_match_finite_differences_and_make_one_step) {
    Case c = random_case();
    const GridRun got = run_grid(c);
    std::vector<double> expected, found, stepped, ended;
    for (std::size_t at = 0; at < kMaps.terms(); at += 5) {
        double& value = c.maps[kMaps.terms() + at];
        const double was = value;
        value = was + 0.5;
        const double above = whole_loss(c);
        value = was - 0.5;
        expected.push_back(above - whole_loss(c));  // linear in a map but for the smoothness
        value = was;
        found.push_back(double{got.d_maps[at]});
        // Adam's first step is the rate, of a grid four times; the mean over the photos stays.
        const double change = -0.04 * (found.back() > 0 ? 1 : -1);
        stepped.insert(stepped.end(), {c.maps[at] - change / 2, was + change / 2});
        ended.insert(ended.end(), {double{got.state[at]}, double{got.state[kMaps.terms() + at]}});
    }
    EXPECT_TRUE(compare_scaled("d_maps", expected, found, tolerance("gradient_scaled_float32")));
    EXPECT_TRUE(compare("maps", stepped, ended, tolerance("gradient_float32")));
}

TEST(ExposureGrid, repeats_bit_by_bit) {
    const Case c = random_case();
    EXPECT_EQ(run_grid(c).state, run_grid(c).state);
}

}  // namespace
}  // namespace darb::test
