// SPDX-License-Identifier: MIT
// FLIP against the paper's formulas written out pixel by pixel in double, and what must hold of it.
#include "engine/data/flip.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "engine/core/error.h"

namespace darb {
namespace {

using Colour = std::array<double, 3>;
constexpr double kPi = 3.14159265358979323846;

// The matrix as the authors' note prints it, in fractions.
constexpr double kMatrix[3][3] = {
    {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
    {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
    {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};

Colour xyz_of(const Colour& rgb) {
    Colour out{};
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) out[r] += kMatrix[r][c] * rgb[c];
    return out;
}

/// By Cramer's rule.
Colour rgb_of(const Colour& xyz) {
    const auto determinant = [](const double(&m)[3][3]) {
        return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
               m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
               m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    };
    Colour out{};
    for (int c = 0; c < 3; ++c) {
        double replaced[3][3];
        for (int r = 0; r < 3; ++r)
            for (int k = 0; k < 3; ++k) replaced[r][k] = k == c ? xyz[r] : kMatrix[r][k];
        out[c] = determinant(replaced) / determinant(kMatrix);
    }
    return out;
}

Colour hunt(const Colour& rgb) {
    const Colour xyz = xyz_of(rgb), white = xyz_of({1, 1, 1});
    const auto f = [](double t) {
        return t > 216.0 / 24389 ? std::pow(t, 1.0 / 3) : t * 841 / 108 + 4.0 / 29;
    };
    const double x = f(xyz[0] / white[0]), y = f(xyz[1] / white[1]), z = f(xyz[2] / white[2]);
    const double l = 116 * y - 16;
    return {l, 5 * l * (x - y), 2 * l * (y - z)};
}

/// One pixel of one picture, everything by sums over a square.
class Slow {
  public:
    Slow(const ImageF& image, double ppd) : image_(image), ppd_(ppd) {}

    Colour colour(int x, int y) const {
        const double a[3] = {1, 1, 34.1}, b[3] = {0.0047, 0.0053, 0.04};
        const int radius = int(std::ceil(3 * std::sqrt(0.04 / (2 * kPi * kPi)) * ppd_));
        Colour sum{}, weights{};
        for (int j = -radius; j <= radius; ++j)
            for (int i = -radius; i <= radius; ++i) {
                const Colour its = opponent(x + i, y + j);
                const double d = (i * i + j * j) / (ppd_ * ppd_);
                for (int c = 0; c < 3; ++c) {
                    double w = a[c] * std::sqrt(kPi / b[c]) * std::exp(-kPi * kPi * d / b[c]);
                    if (c == 2)
                        w += 13.5 * std::sqrt(kPi / 0.025) * std::exp(-kPi * kPi * d / 0.025);
                    sum[c] += w * its[c];
                    weights[c] += w;
                }
            }
        for (int c = 0; c < 3; ++c) sum[c] /= weights[c];
        const Colour white = xyz_of({1, 1, 1});
        const double l = (sum[0] + 16) / 116;
        Colour rgb =
            rgb_of({(sum[1] / 500 + l) * white[0], l * white[1], (l - sum[2] / 200) * white[2]});
        for (double& v : rgb) v = std::fmin(std::fmax(v, 0), 1);
        return hunt(rgb);
    }

    double edge(int x, int y) const {
        return std::hypot(feature(x, y, true, false), feature(x, y, false, false));
    }
    double point(int x, int y) const {
        return std::hypot(feature(x, y, true, true), feature(x, y, false, true));
    }

  private:
    Colour opponent(int x, int y) const {
        x = std::min(std::max(x, 0), image_.width - 1);
        y = std::min(std::max(y, 0), image_.height - 1);
        Colour linear{};
        for (int c = 0; c < 3; ++c) {
            const double v = image_.at(x, y, c);
            linear[c] = v > 0.04045 ? std::pow((v + 0.055) / 1.055, 2.4) : v / 12.92;
        }
        const Colour xyz = xyz_of(linear), white = xyz_of({1, 1, 1});
        const double r = xyz[0] / white[0], g = xyz[1] / white[1], b = xyz[2] / white[2];
        return {116 * g - 16, 500 * (r - g), 200 * (g - b)};
    }

    double feature(int x, int y, bool horizontal, bool second) const {
        const double sigma = 0.5 * 0.082 * ppd_;
        const int radius = int(std::ceil(3 * sigma));
        double above = 0, below = 0, of_above = 0, of_below = 0;
        for (int j = -radius; j <= radius; ++j)
            for (int i = -radius; i <= radius; ++i) {
                const double t = horizontal ? i : j;
                const double w = (second ? t * t / (sigma * sigma) - 1 : -t) *
                                 std::exp(-(i * i + j * j) / (2 * sigma * sigma));
                const double value = (opponent(x + i, y + j)[0] + 16) / 116;
                (w > 0 ? above : below) += w;
                (w > 0 ? of_above : of_below) += w * value;
            }
        return of_above / above - of_below / below;
    }

    const ImageF& image_;
    double ppd_;
};

double slow_flip(const ImageF& a, const ImageF& b, double ppd, int x, int y) {
    const auto hyab = [](const Colour& p, const Colour& q) {
        return std::abs(p[0] - q[0]) + std::hypot(p[1] - q[1], p[2] - q[2]);
    };
    const Slow first(a, ppd), second(b, ppd);
    const double most = std::pow(hyab(hunt({0, 1, 0}), hunt({0, 0, 1})), 0.7);
    const double error = std::pow(hyab(first.colour(x, y), second.colour(x, y)), 0.7);
    const double colour = error < 0.4 * most ? 0.95 * error / (0.4 * most)
                                             : 0.95 + 0.05 * (error - 0.4 * most) / (0.6 * most);
    const double feature = std::max(std::abs(first.edge(x, y) - second.edge(x, y)),
                                    std::abs(first.point(x, y) - second.point(x, y)));
    return std::pow(colour, 1 - std::sqrt(feature / std::sqrt(2.0)));
}

ImageF filled(int width, int height, const Colour& colour) {
    ImageF image(width, height, 3);
    for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = float(colour[i % 3]);
    return image;
}

ImageF random_picture(int width, int height, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> value(0, 1);
    ImageF image(width, height, 3);
    for (float& v : image.data) v = value(random);
    return image;
}

TEST(Flip, Map_isThatOfTheFormulasPixelByPixel) {
    ImageF a = random_picture(29, 23, 1), b = random_picture(29, 23, 2);
    for (int y = 5; y < 15; ++y)  // a flat part with an edge in one of them
        for (int x = 3; x < 20; ++x)
            for (int c = 0; c < 3; ++c) {
                a.at(x, y, c) = 0.3f;
                b.at(x, y, c) = x < 12 ? 0.3f : 0.35f;
            }
    for (const double ppd : {kFlipPixelsPerDegree, 30.0}) {
        const ImageF map = flip_map(a, b, ppd);
        for (const auto& [x, y] : {std::pair{0, 0}, {28, 22}, {11, 10}, {12, 10}, {3, 20}, {25, 2}})
            EXPECT_NEAR(map.at(x, y, 0), slow_flip(a, b, ppd, x, y), 2e-4) << x << ", " << y;
    }
}

TEST(Flip, FlatPictures_haveTheDistanceOfTheirColours) {
    // Without edges only the colour counts. Black against white: L* 100 apart.
    const double most = std::pow(203.302, 0.7);  // green and blue, Hunt-adjusted
    const double white = std::pow(100, 0.7);
    const double expected = 0.95 + 0.05 * (white - 0.4 * most) / (0.6 * most);
    EXPECT_NEAR(flip(filled(16, 12, {0, 0, 0}), filled(16, 12, {1, 1, 1})), expected, 1e-3);
    // The pair that the scale is made by.
    EXPECT_NEAR(flip(filled(16, 12, {0, 1, 0}), filled(16, 12, {0, 0, 1})), 1, 1e-5);
}

TEST(Flip, EqualPictures_haveNone_andOrderDoesNotMatter) {
    const ImageF a = random_picture(20, 16, 3), b = random_picture(20, 16, 4);
    EXPECT_EQ(flip(a, a), 0);
    EXPECT_EQ(flip(a, b), flip(b, a));
    for (const float v : flip_map(a, b).data) {
        EXPECT_GE(v, 0);
        EXPECT_LE(v, 1);
    }
}

TEST(Flip, Error_growsWithContrastAndFallsWithDistance) {
    const ImageF grey = filled(32, 24, {0.5, 0.5, 0.5});
    double before = 0;
    for (const double step : {0.02, 0.05, 0.1, 0.3}) {
        const double now = flip(filled(32, 24, {0.5 + step, 0.5 + step, 0.5 + step}), grey);
        EXPECT_GT(now, before);
        before = now;
    }
    // A chequerboard of single pixels melts into grey for who stands far away.
    ImageF chequers = grey;
    for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 32; ++x)
            for (int c = 0; c < 3; ++c) chequers.at(x, y, c) = (x + y) % 2 == 0 ? 0.4f : 0.6f;
    EXPECT_LT(flip(chequers, grey, 200), flip(chequers, grey, 10));
}

TEST(Flip, OtherSizes_areRefused) {
    EXPECT_THROW(flip(filled(8, 8, {0, 0, 0}), filled(8, 9, {0, 0, 0})), Error);
    EXPECT_THROW(flip(ImageF(8, 8, 1), ImageF(8, 8, 1)), Error);
}

}  // namespace
}  // namespace darb
