// SPDX-License-Identifier: MIT
// shaders/loss against a brute force in double: values, gradient, sizes, mask, guards, repeats.
#include "engine/raster/loss.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "engine/core/rng.h"
#include "tests/support/same_rounding.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_device_options.h"

namespace darb {
namespace {

constexpr std::uint32_t kNanGuard = 0x7fc0dead;  // a NaN
constexpr int kNanGuardWords = 64;
constexpr std::uint32_t kResultIndex = 2;

struct Case {
    int width, height;
    glm::vec3 background{0.1f, 0.6f, 0.9f};
    float lambda = 0.2f;
    bool use_mask = false;
    bool opaque = false;
    bool equal = false;  // the image is the photo
};

struct Data {
    std::vector<float> image;          // [3][H][W]
    std::vector<std::uint32_t> photo;  // [H][W]
};

Data make_data(const Case& c) {
    Pcg32 rng(static_cast<std::uint64_t>(c.width * 1000 + c.height));
    Data data;
    const int pixels = c.width * c.height;
    data.image.resize(3 * static_cast<std::size_t>(pixels));
    for (int i = 0; i < pixels; ++i) {
        // Smooth, with noise: SSIM takes every value from about 0 to 1.
        const double wave = 0.5 + 0.4 * std::sin(0.21 * (i % c.width) + 0.13 * (i / c.width));
        std::uint32_t rgba = 0;
        for (int ch = 0; ch < 3; ++ch) {
            const double y = std::clamp(wave + 0.1 * rng.normal(), 0.0, 1.0);
            const auto byte = static_cast<std::uint32_t>(std::lround(255 * y));
            rgba |= byte << (8 * ch);
            const double x = wave + 0.15 * rng.normal();  // leaves [0, 1] at times
            data.image[static_cast<std::size_t>(ch * pixels + i)] =
                c.equal ? static_cast<float>(byte) * (1.0f / 255.0f) : static_cast<float>(x);
        }
        const std::uint32_t alpha = c.opaque ? 255 : rng.below(256);
        data.photo.push_back(rgba | alpha << 24);
    }
    return data;
}

struct Expected {
    double l1 = 0, ssim = 0, mse = 0, weight = 0;
    std::vector<double> gradient;  // [3][H][W]
};

// One channel at a time, every window summed tap by tap.
struct BruteForce {
    int w, h;
    std::vector<double> x, y, taps;

    explicit BruteForce(int width, int height) : w(width), h(height) {
        double sum = 0;
        for (int i = -5; i <= 5; ++i) taps.push_back(std::exp(-i * i / 4.5));
        for (double t : taps) sum += t;
        for (double& t : taps) t /= sum;
    }
    template <class F>
    double window(int cx, int cy, F&& value) const {
        double sum = 0;
        for (int j = -5; j <= 5; ++j)
            for (int i = -5; i <= 5; ++i) {
                const int px = cx + i, py = cy + j;
                if (px < 0 || py < 0 || px >= w || py >= h) continue;
                const auto at = static_cast<std::size_t>(py * w + px);
                sum += taps[static_cast<std::size_t>(i + 5)] *
                       taps[static_cast<std::size_t>(j + 5)] * value(at);
            }
        return sum;
    }
    // Sum of the SSIM map; gradient: d sum / d x.
    double ssim(std::vector<double>& gradient) const {
        const std::size_t n = x.size();
        std::vector<double> d_mx(n), d_xx(n), d_xy(n);
        double sum = 0;
        for (std::size_t p = 0; p < n; ++p) {
            const int cx = static_cast<int>(p) % w, cy = static_cast<int>(p) / w;
            const double mx = window(cx, cy, [&](auto q) { return x[q]; });
            const double my = window(cx, cy, [&](auto q) { return y[q]; });
            const double vx = window(cx, cy, [&](auto q) { return x[q] * x[q]; }) - mx * mx;
            const double vy = window(cx, cy, [&](auto q) { return y[q] * y[q]; }) - my * my;
            const double vxy = window(cx, cy, [&](auto q) { return x[q] * y[q]; }) - mx * my;
            const double a1 = 2 * mx * my + 1e-4, a2 = 2 * vxy + 9e-4;
            const double b1 = mx * mx + my * my + 1e-4, b2 = vx + vy + 9e-4;
            sum += a1 * a2 / (b1 * b2);
            const double d_vx = -a1 * a2 / (b1 * b2 * b2), d_vxy = 2 * a1 / (b1 * b2);
            d_mx[p] = 2 * my * a2 / (b1 * b2) - 2 * mx * a1 * a2 / (b1 * b1 * b2) - 2 * mx * d_vx -
                      my * d_vxy;
            d_xx[p] = d_vx;
            d_xy[p] = d_vxy;
        }
        gradient.resize(n);
        for (std::size_t p = 0; p < n; ++p) {
            const int cx = static_cast<int>(p) % w, cy = static_cast<int>(p) / w;
            gradient[p] = window(
                cx, cy, [&](auto q) { return d_mx[q] + 2 * x[p] * d_xx[q] + y[p] * d_xy[q]; });
        }
        return sum;
    }
};

Expected expect(const Case& c, const Data& data) {
    const auto n = static_cast<std::size_t>(c.width * c.height);
    const double scale = 1.0 / (3.0 * static_cast<double>(n));
    Expected e;
    for (std::size_t ch = 0; ch < 3; ++ch) {
        BruteForce plane(c.width, c.height);
        std::vector<bool> counts(n, true);
        for (std::size_t p = 0; p < n; ++p) {
            const std::uint32_t rgba = data.photo[p];
            const double alpha = (rgba >> 24) / 255.0;
            double x = static_cast<double>(data.image[ch * n + p]);
            double y = (rgba >> (8 * ch) & 255) / 255.0;
            if (c.use_mask) {
                counts[p] = (rgba >> 24) >= 128;
                if (!counts[p]) x = y = 0;
            } else {
                y = y * alpha +
                    static_cast<double>(c.background[static_cast<int>(ch)]) * (1 - alpha);
            }
            plane.x.push_back(x);
            plane.y.push_back(y);
            const double clamped = std::clamp(x, 0.0, 1.0) - y;
            e.l1 += scale * std::abs(x - y);
            e.mse += scale * clamped * clamped;
            e.weight += counts[p] ? scale : 0;
        }
        std::vector<double> gradient;
        e.ssim += scale * plane.ssim(gradient);
        const double lambda = static_cast<double>(c.lambda);
        for (std::size_t p = 0; p < n; ++p) {
            const double error = plane.x[p] - plane.y[p];
            const double sign = error > 0 ? 1 : error < 0 ? -1 : 0;
            const double value = (1 - lambda) * sign * scale - lambda * gradient[p] * scale;
            e.gradient.push_back(counts[p] ? value : 0);
        }
    }
    return e;
}

struct Output {
    gpu::LossResult result{};
    std::vector<float> gradient;
    std::uint64_t guards_hit = 0;
    double ms = 0;
};

Device& device() {
    static Device instance([] {
        DeviceOptions options = test::device_options();
        options.validation = true;
        return options;
    }());
    return instance;
}

std::uint64_t count_changed(const std::vector<std::uint32_t>& words, std::size_t from,
                            std::size_t to) {
    return static_cast<std::uint64_t>(
        std::count_if(words.begin() + static_cast<std::ptrdiff_t>(from),
                      words.begin() + static_cast<std::ptrdiff_t>(to),
                      [](std::uint32_t word) { return word != kNanGuard; }));
}

Output run(Loss& loss, const Case& c, const Data& data, int repeats = 1) {
    const std::size_t words = data.image.size();
    Buffer image(device(), "image", words * 4);
    Buffer photo(device(), "photo", data.photo.size() * 4);
    Buffer d_image(device(), "d_image", (words + kNanGuardWords) * 4);
    Buffer results(device(), "results", 4 * sizeof(gpu::LossResult));
    image.upload(data.image);
    photo.upload(data.photo);
    d_image.upload(std::vector<std::uint32_t>(words + kNanGuardWords, kNanGuard));
    results.upload(std::vector<std::uint32_t>(16, kNanGuard));
    Output out;
    out.ms = 1e9;
    for (int i = 0; i < repeats; ++i) {
        Commands commands(device());
        commands.begin();
        loss.record(commands, {image, photo, d_image, results, kResultIndex}, c.width, c.height,
                    c.background, c.lambda);
        commands.submit_and_wait();
        for (const PassTime& time : commands.pass_times()) out.ms = std::min(out.ms, time.ms);
    }
    const auto after = d_image.download<std::uint32_t>(words + kNanGuardWords);
    out.guards_hit = count_changed(after, words, words + kNanGuardWords);
    const auto slots = results.download<std::uint32_t>(16);
    out.guards_hit += count_changed(slots, 0, 8) + count_changed(slots, 12, 16);
    out.gradient = d_image.download<float>(words);
    out.result = results.download<gpu::LossResult>(4)[kResultIndex];
    return out;
}

/// With tiles in place of strips while it lives.
struct ByTiles {
    test::ScopedVariants variants{device(), "loss=tiles"};
};

Output run(const Case& c, const Data& data) {
    Loss loss(device(), c.width, c.height, {.use_mask = c.use_mask});
    return run(loss, c, data);
}

// float32 in windows whose variance is far below C2 leaves about eps / C2 = 1e-4 of each term, so
// values are bounded absolutely and the gradient against its largest element.
void expect_matches(const Case& c) {
    SCOPED_TRACE(testing::Message() << c.width << "x" << c.height << " mask " << c.use_mask);
    const Data data = make_data(c);
    const Expected want = expect(c, data);
    const Output got = run(c, data);
    EXPECT_EQ(got.guards_hit, 0u);
    EXPECT_NEAR(static_cast<double>(got.result.l1), want.l1, 1e-6);
    EXPECT_NEAR(static_cast<double>(got.result.ssim), want.ssim, 1e-5);
    EXPECT_NEAR(static_cast<double>(got.result.mse), want.mse, 1e-6);
    EXPECT_NEAR(static_cast<double>(got.result.weight), want.weight, 1e-6);
    double largest = 0, worst = 0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < want.gradient.size(); ++i) {
        largest = std::max(largest, std::abs(want.gradient[i]));
        const double error = std::abs(static_cast<double>(got.gradient[i]) - want.gradient[i]);
        if (!(error <= worst)) {
            worst = error;
            at = i;
        }
    }
    EXPECT_LE(worst, 1e-4 * largest + 1e-12)
        << "at " << at << ": expected " << want.gradient[at] << " got " << got.gradient[at];
    EXPECT_EQ(device().validation_message_count(), 0u);
}

TEST(Loss_sizes, match_brute_force) {
    for (const auto& [width, height] :
         {std::pair{1, 1}, {1, 37}, {37, 1}, {16, 16}, {44, 17}, {45, 33}, {200, 149}, {7, 300}})
        expect_matches({width, height});
}

TEST(Loss_byTiles, matches_brute_force_and_has_the_gradient_of_strips) {
    const ByTiles tiles;
    for (const auto& [width, height] : {std::pair{1, 1}, {37, 1}, {16, 17}, {45, 33}})
        expect_matches({width, height});
    for (const Case& c : {Case{.width = 61, .height = 43, .opaque = true},
                          Case{.width = 33, .height = 29, .lambda = 1.0f},
                          Case{.width = 70, .height = 50, .use_mask = true}}) {
        expect_matches(c);
        const Data data = make_data(c);
        const Output by_tiles = run(c, data);
        const test::ScopedVariants strips(device(), "loss=strips");
        const Output by_strips = run(c, data);
        EXPECT_TRUE(test::same_but_for_fusing(by_tiles.gradient, by_strips.gradient, 1e-5));
        EXPECT_NEAR(by_tiles.result.ssim, by_strips.result.ssim, 1e-6);
        EXPECT_NEAR(by_tiles.result.mse, by_strips.result.mse, 1e-7);
        EXPECT_EQ(by_tiles.result.weight, by_strips.result.weight);
    }
}

TEST(Loss_opaquePhoto_ignoresBackground, matches_brute_force) {
    expect_matches({.width = 61, .height = 43, .opaque = true});
}

// Photos without alpha: the code that reads alpha is compiled out, and the results stay equal.
TEST(Loss_opaquePhoto_withoutAlpha, is_the_same) {
    const Case c{.width = 61, .height = 43, .opaque = true};
    const Data data = make_data(c);
    const Output with = run(c, data);
    Loss loss(device(), c.width, c.height, {.use_alpha = false});
    const Output without = run(loss, c, data);
    EXPECT_TRUE(test::same_but_for_fusing(with.gradient, without.gradient, 1e-5));
    const auto means = [](const Output& o) {
        return std::array{float(o.result.l1), float(o.result.ssim), float(o.result.mse)};
    };
    EXPECT_TRUE(test::same_but_for_fusing(means(with), means(without), 1e-6));
    EXPECT_EQ(with.result.weight, without.result.weight);
    const Case seen{.width = 61, .height = 43};
    Loss blind(device(), c.width, c.height, {.use_alpha = false});
    EXPECT_NE(run(blind, seen, make_data(seen)).gradient, run(seen, make_data(seen)).gradient)
        << "photos with alpha are meant to need it";
}

TEST(Loss_lambda, both_ends_match_brute_force) {
    expect_matches({.width = 33, .height = 29, .lambda = 0.0f});
    expect_matches({.width = 33, .height = 29, .lambda = 1.0f});
}

TEST(Loss_mask, matches_brute_force_and_has_no_gradient_outside) {
    const Case c{.width = 70, .height = 50, .use_mask = true};
    expect_matches(c);
    const Data data = make_data(c);
    const Output got = run(c, data);
    EXPECT_LT(got.result.weight, 0.9f);
    EXPECT_GT(got.result.weight, 0.1f);
    for (std::size_t i = 0; i < data.photo.size(); ++i) {
        const bool masked = (data.photo[i] >> 24) < 128;
        EXPECT_TRUE(!masked || got.gradient[i] == 0.0f) << i;
    }
}

TEST(Loss_equalImages, are_without_loss_and_gradient) {
    const Case c{.width = 50, .height = 40, .background = {0, 0, 0}, .opaque = true, .equal = true};
    const Output got = run(c, make_data(c));
    EXPECT_NEAR(static_cast<double>(got.result.ssim), 1.0, 1e-6);
    EXPECT_LT(got.result.l1, 1e-7f);
    EXPECT_LT(Loss::value(got.result), 1e-6);
}

TEST(Loss_repeated, is_bit_equal_and_serves_smaller_images) {
    Loss loss(device(), 200, 149);
    const Case big{200, 149}, small{31, 77};
    const Data big_data = make_data(big), small_data = make_data(small);
    const Output first = run(loss, big, big_data);
    const Output other = run(loss, small, small_data);
    EXPECT_EQ(other.gradient, run(small, small_data).gradient);
    const Output again = run(loss, big, big_data, 3);
    EXPECT_EQ(first.gradient, again.gradient);
    EXPECT_EQ(first.result.l1, again.result.l1);
    EXPECT_EQ(first.result.ssim, again.result.ssim);
    EXPECT_EQ(first.result.mse, again.result.mse);
}

TEST(Loss_stripShapes, give_the_same_gradient) {
    const Case c{203, 71};
    const Data data = make_data(c);
    const Output want = run(c, data);
    const int least = 20 / static_cast<int>(device().info().subgroup_size) + 1;
    for (const auto& [columns, rows] :
         {std::pair{least, 16}, {least + 1, 1}, {11, 7}, {16, 1000}}) {
        Loss loss(device(), c.width, c.height, {.columns = columns, .rows = rows});
        const Output got = run(loss, c, data);
        EXPECT_EQ(got.gradient, want.gradient) << columns << " columns, " << rows << " rows";
        EXPECT_NEAR(static_cast<double>(got.result.ssim), static_cast<double>(want.result.ssim),
                    1e-6);
        EXPECT_EQ(got.guards_hit, 0u);
    }
}

// The gradient against the measured change of the loss itself, along a random direction.
TEST(Loss_gradient, is_the_slope_of_the_value) {
    const Case c{.width = 40, .height = 30, .lambda = 1.0f};
    const Data data = make_data(c);
    const Output at = run(c, data);
    Data moved[2] = {data, data};
    Pcg32 rng(5);
    double slope = 0;
    for (std::size_t i = 0; i < data.image.size(); ++i) {
        const double direction = rng.normal();
        slope += direction * static_cast<double>(at.gradient[i]);
        for (int side = 0; side < 2; ++side)
            moved[side].image[i] += static_cast<float>((side == 0 ? -2e-3 : 2e-3) * direction);
    }
    const double low = Loss::value(run(c, moved[0]).result, 1);
    const double high = Loss::value(run(c, moved[1]).result, 1);
    EXPECT_NEAR((high - low) / 4e-3, slope, 2e-2 * std::abs(slope) + 1e-4);
}

// A figure for the log, not a bound: DARB_TIMING=1.
TEST(Loss_timing, is_printed) {
    if (std::getenv("DARB_TIMING") == nullptr) GTEST_SKIP() << "set DARB_TIMING=1";
    for (const auto& [width, height] : {std::pair{200, 149}, {800, 594}, {1600, 1200}}) {
        const Case c{width, height};
        Loss loss(device(), width, height);
        std::printf("loss %dx%d: %.3f ms on %s\n", width, height, run(loss, c, make_data(c), 30).ms,
                    device().info().name.c_str());
    }
}

}  // namespace
}  // namespace darb
