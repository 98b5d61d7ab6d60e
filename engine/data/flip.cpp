// SPDX-License-Identifier: MIT
// The colour part filters both pictures as the eye's contrast sensitivity does, in the opponent
// space YCxCz, and measures their distance in Hunt-adjusted L*a*b*. The feature part compares edges
// and points of their luminance. Section numbers are the paper's.
#include "engine/data/flip.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/on_threads.h"

namespace darb {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kColourPower = 0.7;                // q_c, 4.1.3
constexpr double kKneeAt = 0.4, kKneeValue = 0.95;  // p_c, p_t, 4.1.3
constexpr double kFeatureWidth = 0.082;             // w, degrees, 4.2
constexpr double kFeaturePower = 0.5;               // q_f, 4.2

/// A filter of the contrast sensitivity, 4.1.1: a1 sqrt(pi/b1) exp(-pi^2 x^2/b1) + the same of 2,
/// x in degrees.
struct Sensitivity {
    double a1, b1, a2, b2;
};
constexpr std::array<Sensitivity, 3> kSensitivity = {
    {{1, 0.0047, 0, 1e-5}, {1, 0.0053, 0, 1e-5}, {34.1, 0.04, 13.5, 0.025}}};

/// Linear sRGB to XYZ, by the chromaticities of IEC 61966-2-1 and of D65.
glm::dmat3 rgb_to_xyz() {
    const auto xyz = [](double x, double y) { return glm::dvec3(x / y, 1, (1 - x - y) / y); };
    const glm::dmat3 primaries(xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06));
    const glm::dvec3 amounts = glm::inverse(primaries) * xyz(0.31271, 0.32902);
    return {primaries[0] * amounts.x, primaries[1] * amounts.y, primaries[2] * amounts.z};
}

struct ColourSpace {
    glm::dmat3 to_xyz = rgb_to_xyz();
    glm::dmat3 to_rgb = glm::inverse(to_xyz);
    glm::dvec3 white = to_xyz * glm::dvec3(1);
};

glm::dvec3 hunt_lab(const ColourSpace& space, const glm::dvec3& linear) {
    constexpr double kDelta = 6.0 / 29;
    const glm::dvec3 ratio = space.to_xyz * linear / space.white;
    glm::dvec3 f;
    for (int i = 0; i < 3; ++i)
        f[i] = ratio[i] > kDelta * kDelta * kDelta ? std::cbrt(ratio[i])
                                                   : ratio[i] / (3 * kDelta * kDelta) + 4.0 / 29;
    const double lightness = 116 * f.y - 16;
    return {lightness, 0.01 * lightness * 500 * (f.x - f.y), 0.01 * lightness * 200 * (f.y - f.z)};
}

double hyab(const glm::dvec3& a, const glm::dvec3& b) {
    return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z);
}

using Taps = std::vector<float>;

struct Plane {
    int width = 0, height = 0;
    std::vector<float> values;

    Plane(int w, int h) : width(w), height(h), values(static_cast<std::size_t>(w) * h, 0.0f) {}
};

/// Along x and then along y; beyond the edge, its pixels go on.
Plane convolved(const Plane& in, const Taps& along_x, const Taps& along_y) {
    Plane across(in.width, in.height), out(in.width, in.height);
    const int radius_x = static_cast<int>(along_x.size() / 2);
    const int radius_y = static_cast<int>(along_y.size() / 2);
    const auto width = static_cast<std::size_t>(in.width);
    std::vector<float> padded(width + along_x.size());
    for (int y = 0; y < in.height; ++y) {
        const float* row = &in.values[static_cast<std::size_t>(y) * width];
        for (int x = -radius_x; x < in.width + radius_x; ++x)
            padded[static_cast<std::size_t>(x + radius_x)] = row[std::clamp(x, 0, in.width - 1)];
        float* to = &across.values[static_cast<std::size_t>(y) * width];
        for (std::size_t tap = 0; tap < along_x.size(); ++tap)
            for (std::size_t x = 0; x < width; ++x) to[x] += along_x[tap] * padded[x + tap];
    }
    for (int y = 0; y < in.height; ++y) {
        float* to = &out.values[static_cast<std::size_t>(y) * width];
        for (std::size_t tap = 0; tap < along_y.size(); ++tap) {
            const int from = std::clamp(y + static_cast<int>(tap) - radius_y, 0, in.height - 1);
            const float* row = &across.values[static_cast<std::size_t>(from) * width];
            for (std::size_t x = 0; x < width; ++x) to[x] += along_y[tap] * row[x];
        }
    }
    return out;
}

/// Values at -radius to radius, those above 0 scaled to the sum 1 and those below to -1.
template <class F>
Taps taps_of(int radius, const F& value) {
    std::vector<double> raw;
    double above = 0, below = 0;
    for (int i = -radius; i <= radius; ++i) {
        raw.push_back(value(i));
        (raw.back() > 0 ? above : below) += raw.back();
    }
    Taps taps;
    for (const double v : raw)
        taps.push_back(static_cast<float>(v > 0 ? v / above : below < 0 ? v / -below : 0.0));
    return taps;
}

/// The filter of one channel. The sum of two Gaussians is not separable, but each of them is.
Plane seen(const Plane& channel, const Sensitivity& s, double pixels_per_degree) {
    double widest = 0;
    for (const Sensitivity& one : kSensitivity) widest = std::max({widest, one.b1, one.b2});
    const int radius =
        static_cast<int>(std::ceil(3 * std::sqrt(widest / (2 * kPi * kPi)) * pixels_per_degree));
    const auto gaussian = [&](double b) {
        return [=](int i) {
            const double x = i / pixels_per_degree;
            return std::exp(-kPi * kPi * x * x / b);
        };
    };
    const auto share = [&](double a, double b) {  // of the sum over the filter
        double sum = 0;
        for (int i = -radius; i <= radius; ++i) sum += gaussian(b)(i);
        return a * std::sqrt(kPi / b) * sum * sum;
    };
    const Taps first = taps_of(radius, gaussian(s.b1));
    Plane result = convolved(channel, first, first);
    if (s.a2 == 0) return result;
    const Taps second = taps_of(radius, gaussian(s.b2));
    const Plane other = convolved(channel, second, second);
    const double one = share(s.a1, s.b1), two = share(s.a2, s.b2);
    for (std::size_t i = 0; i < result.values.size(); ++i)
        result.values[i] =
            static_cast<float>((one * result.values[i] + two * other.values[i]) / (one + two));
    return result;
}

/// What is compared of one picture.
struct Features {
    std::vector<glm::dvec3> colour;  // Hunt-adjusted L*a*b* of what is seen
    std::vector<float> edges, points;
};

std::array<Plane, 3> opponent_channels(const ColourSpace& space, const ImageF& image) {
    const Plane empty(image.width, image.height);
    std::array<Plane, 3> channels{empty, empty, empty};
    const auto linear = [](float v) {
        const double c = std::clamp(static_cast<double>(v), 0.0, 1.0);
        return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    };
    for (std::size_t i = 0; i < empty.values.size(); ++i) {
        const float* rgb = &image.data[i * static_cast<std::size_t>(image.channels)];
        const glm::dvec3 ratio =
            space.to_xyz * glm::dvec3(linear(rgb[0]), linear(rgb[1]), linear(rgb[2])) / space.white;
        channels[0].values[i] = static_cast<float>(116 * ratio.y - 16);
        channels[1].values[i] = static_cast<float>(500 * (ratio.x - ratio.y));
        channels[2].values[i] = static_cast<float>(200 * (ratio.y - ratio.z));
    }
    return channels;
}

/// Magnitudes of a derivative of the luminance, along x and y.
std::vector<float> magnitudes(const Plane& luminance, const Taps& derivative, const Taps& smooth) {
    const Plane x = convolved(luminance, derivative, smooth);
    const Plane y = convolved(luminance, smooth, derivative);
    std::vector<float> result;
    for (std::size_t i = 0; i < x.values.size(); ++i)
        result.push_back(std::hypot(x.values[i], y.values[i]));
    return result;
}

Features features_of(const ColourSpace& space, const ImageF& image, double pixels_per_degree) {
    Features features;
    std::array<Plane, 3> channels = opponent_channels(space, image);
    Plane luminance = channels[0];
    for (float& v : luminance.values) v = (v + 16) / 116;
    const double sigma = 0.5 * kFeatureWidth * pixels_per_degree;
    const int radius = static_cast<int>(std::ceil(3 * sigma));
    const auto gaussian = [=](int i) { return std::exp(-i * i / (2 * sigma * sigma)); };
    const Taps smooth = taps_of(radius, gaussian);
    const Taps slope = taps_of(radius, [=](int i) { return -i * gaussian(i); });
    const Taps bend =
        taps_of(radius, [=](int i) { return (i * i / (sigma * sigma) - 1) * gaussian(i); });
    features.edges = magnitudes(luminance, slope, smooth);
    features.points = magnitudes(luminance, bend, smooth);
    for (std::size_t c = 0; c < channels.size(); ++c)
        channels[c] = seen(channels[c], kSensitivity[c], pixels_per_degree);
    for (std::size_t i = 0; i < luminance.values.size(); ++i) {
        const double y = (channels[0].values[i] + 16.0) / 116;
        const glm::dvec3 ratio(channels[1].values[i] / 500.0 + y, y,
                               y - channels[2].values[i] / 200.0);
        const glm::dvec3 rgb = space.to_rgb * (ratio * space.white);
        features.colour.push_back(hunt_lab(space, glm::clamp(rgb, 0.0, 1.0)));
    }
    return features;
}

/// The distance of two colours on a scale of 0 to 1, 4.1.3. largest: that of green and blue.
double colour_error(double distance, double largest) {
    const double error = std::pow(distance, kColourPower), knee = kKneeAt * largest;
    if (error < knee) return kKneeValue / knee * error;
    return kKneeValue + (error - knee) / (largest - knee) * (1 - kKneeValue);
}

}  // namespace

ImageF flip_map(const ImageF& image, const ImageF& truth, double pixels_per_degree) {
    if (image.width != truth.width || image.height != truth.height ||
        image.channels != truth.channels || image.channels < 3 || image.data.empty())
        throw Error(
            "comparison",
            fmt::format("the pictures have different sizes, {}x{}x{} and {}x{}x{}", image.width,
                        image.height, image.channels, truth.width, truth.height, truth.channels),
            "Compare colour pictures of one size.");
    const ColourSpace space;
    std::array<Features, 2> both;
    std::atomic<std::size_t> next{0};
    on_threads(2, [&] {
        for (std::size_t i; (i = next++) < both.size();)
            both[i] = features_of(space, i == 0 ? image : truth, pixels_per_degree);
    });
    const double largest =
        std::pow(hyab(hunt_lab(space, {0, 1, 0}), hunt_lab(space, {0, 0, 1})), kColourPower);
    ImageF map(image.width, image.height, 1);
    for (std::size_t i = 0; i < map.data.size(); ++i) {
        const double colour = colour_error(hyab(both[0].colour[i], both[1].colour[i]), largest);
        const double features =
            std::max(std::abs(double{both[0].edges[i]} - double{both[1].edges[i]}),
                     std::abs(double{both[0].points[i]} - double{both[1].points[i]}));
        const double feature = std::pow(features / std::sqrt(2.0), kFeaturePower);
        map.data[i] = static_cast<float>(std::pow(colour, 1 - feature));
    }
    return map;
}

double flip(const ImageF& image, const ImageF& truth, double pixels_per_degree) {
    const ImageF map = flip_map(image, truth, pixels_per_degree);
    double sum = 0;
    for (const float v : map.data) sum += v;
    return sum / static_cast<double>(map.data.size());
}

}  // namespace darb
