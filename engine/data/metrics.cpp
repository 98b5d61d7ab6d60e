// SPDX-License-Identifier: MIT
#include "engine/data/metrics.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/on_threads.h"
#include "engine/core/quantile.h"
#include "engine/data/flip.h"

namespace darb {

namespace {

constexpr int kRadius = 5;  // window 11
constexpr double kSigma = 1.5;
constexpr float kC1 = 1e-4f, kC2 = 9e-4f;
constexpr int kMoments = 5;  // x, y, x^2, y^2, xy

using Window = std::array<float, 2 * kRadius + 1>;

Window gaussian_window() {
    std::array<double, 2 * kRadius + 1> weights{};
    double sum = 0;
    for (std::size_t k = 0; k < weights.size(); ++k) {
        const int i = static_cast<int>(k) - kRadius;
        weights[k] = std::exp(-i * i / (2 * kSigma * kSigma));
        sum += weights[k];
    }
    Window window{};
    for (std::size_t i = 0; i < window.size(); ++i)
        window[i] = static_cast<float>(weights[i] / sum);
    return window;
}

int used_channels(const ImageF& image) {
    return std::min(image.channels, 3);
}

void check_same_size(const ImageF& a, const ImageF& b) {
    if (a.width != b.width || a.height != b.height || a.channels != b.channels || a.data.empty())
        throw Error("comparison",
                    fmt::format("the pictures have different sizes, {}x{}x{} and {}x{}x{}", a.width,
                                a.height, a.channels, b.width, b.height, b.channels),
                    "Compare pictures of one size and number of channels.");
}

/// The five moments of one image row, filtered along x: [kMoments][width].
void filter_row(const ImageF& a, const ImageF& b, int y, int channel, const Window& window,
                std::vector<float>& padded, float* out) {
    const auto width = static_cast<std::size_t>(a.width);
    const std::size_t stride = width + 2 * kRadius;
    for (std::size_t x = 0; x < width; ++x) {
        const std::size_t at = (static_cast<std::size_t>(y) * width + x) * a.channels + channel;
        const float p = std::clamp(a.data[at], 0.0f, 1.0f);
        const float q = std::clamp(b.data[at], 0.0f, 1.0f);
        const float moments[kMoments] = {p, q, p * p, q * q, p * q};
        for (std::size_t m = 0; m < kMoments; ++m) padded[m * stride + kRadius + x] = moments[m];
    }
    std::fill(out, out + kMoments * width, 0.0f);
    for (std::size_t m = 0; m < kMoments; ++m)
        for (std::size_t tap = 0; tap < window.size(); ++tap) {
            const float* from = &padded[m * stride + tap];
            float* to = out + m * width;
            for (std::size_t x = 0; x < width; ++x) to[x] += window[tap] * from[x];
        }
}

/// SSIM at one pixel, from the filtered moments.
float ssim_at(const float* moments, std::size_t stride) {
    const float p = moments[0], q = moments[stride];
    const float var_p = moments[2 * stride] - p * p, var_q = moments[3 * stride] - q * q;
    const float covariance = moments[4 * stride] - p * q;
    return ((2 * p * q + kC1) * (2 * covariance + kC2)) /
           ((p * p + q * q + kC1) * (var_p + var_q + kC2));
}

/// Sum of SSIM over rows [begin, end) of one channel. A ring buffer holds the last 11 filtered
/// rows.
double ssim_rows(const ImageF& a, const ImageF& b, int channel, int begin, int end) {
    static const Window window = gaussian_window();
    const auto width = static_cast<std::size_t>(a.width);
    const std::size_t row_values = kMoments * width;
    std::vector<float> padded(kMoments * (width + 2 * kRadius), 0.0f), sum(row_values);
    std::vector<float> ring(window.size() * row_values, 0.0f);
    double total = 0;
    for (int y = begin - kRadius; y < end + kRadius; ++y) {
        float* slot =
            &ring[static_cast<std::size_t>(y + kRadius - begin) % window.size() * row_values];
        if (y >= 0 && y < a.height)
            filter_row(a, b, y, channel, window, padded, slot);
        else
            std::fill(slot, slot + row_values, 0.0f);
        if (y < begin + kRadius) continue;
        const int centre = y - kRadius;
        std::fill(sum.begin(), sum.end(), 0.0f);
        for (std::size_t tap = 0; tap < window.size(); ++tap) {
            const auto row = static_cast<std::size_t>(centre - begin) + tap;
            const float* from = &ring[row % window.size() * row_values];
            for (std::size_t k = 0; k < row_values; ++k) sum[k] += window[tap] * from[k];
        }
        for (std::size_t x = 0; x < width; ++x)
            total += static_cast<double>(ssim_at(&sum[x], width));
    }
    return total;
}

}  // namespace

double psnr(const ImageF& image, const ImageF& truth) {
    check_same_size(image, truth);
    const auto channels = static_cast<std::size_t>(image.channels);
    const auto used = static_cast<std::size_t>(used_channels(image));
    double sum = 0;
    for (std::size_t i = 0; i < image.data.size(); i += channels)
        for (std::size_t c = 0; c < used; ++c) {
            const double difference =
                static_cast<double>(std::clamp(image.data[i + c], 0.0f, 1.0f)) -
                static_cast<double>(std::clamp(truth.data[i + c], 0.0f, 1.0f));
            sum += difference * difference;
        }
    const std::size_t compared = image.data.size() / channels * used;
    const double mean = sum / static_cast<double>(compared);
    return mean == 0 ? std::numeric_limits<double>::infinity() : -10 * std::log10(mean);
}

double ssim(const ImageF& image, const ImageF& truth, int threads) {
    check_same_size(image, truth);
    const int parts = std::clamp(threads, 1, image.height);
    std::vector<double> sums(static_cast<std::size_t>(parts), 0.0);
    std::atomic<int> next{0};
    on_threads(static_cast<std::size_t>(parts), [&] {
        for (int part; (part = next++) < parts;) {
            const int begin = static_cast<int>(std::int64_t{image.height} * part / parts);
            const int end = static_cast<int>(std::int64_t{image.height} * (part + 1) / parts);
            for (int c = 0; c < used_channels(image); ++c)
                sums[static_cast<std::size_t>(part)] += ssim_rows(image, truth, c, begin, end);
        }
    });
    double total = 0;
    for (const double sum : sums) total += sum;
    return total / (static_cast<double>(image.width) * image.height * used_channels(image));
}

ImageF to_float(const ImageU8& image) {
    ImageF out(image.width, image.height, image.channels);
    std::transform(image.data.begin(), image.data.end(), out.data.begin(),
                   [](std::uint8_t value) { return static_cast<float>(value) / 255.0f; });
    return out;
}

namespace {

constexpr float kErrorGain = 4.0f;
constexpr float kLeastCover = 0.5f;  // as in training: with less cover, there is no surface to
                                     // compare
constexpr double kEqual_db = 100;    // reported for a render that equals its photo

}  // namespace

ImageF composite(const ImageU8& photo, const glm::vec3& background) {
    ImageF image(photo.width, photo.height, 3);
    const size_t pixels = size_t(photo.width) * photo.height;
    for (size_t p = 0; p < pixels; ++p) {
        const float alpha = photo.channels == 4 ? photo.data[p * 4 + 3] / 255.0f : 1.0f;
        for (int c = 0; c < 3; ++c)
            image.data[p * 3 + c] = photo.data[p * photo.channels + c] / 255.0f * alpha +
                                    background[c] * (1.0f - alpha);
    }
    return image;
}

ImageU8 to_8bit(const ImageF& image) {
    ImageU8 result(image.width, image.height, image.channels);
    for (size_t i = 0; i < image.data.size(); ++i) {
        const float v = image.data[i];
        result.data[i] =
            static_cast<std::uint8_t>(v > 0.0f ? std::min(v, 1.0f) * 255.0f + 0.5f : 0.0f);
    }
    return result;
}

ImageU8 side_by_side(const ImageF& photo, const ImageF& render) {
    ImageF all(photo.width * 3, photo.height, 3);
    for (int y = 0; y < photo.height; ++y)
        for (int x = 0; x < photo.width; ++x)
            for (int c = 0; c < 3; ++c) {
                const float truth = photo.at(x, y, c);
                const float shown = std::clamp(render.at(x, y, c), 0.0f, 1.0f);
                all.at(x, y, c) = truth;
                all.at(photo.width + x, y, c) = shown;
                all.at(2 * photo.width + x, y, c) = kErrorGain * std::abs(shown - truth);
            }
    return to_8bit(all);
}

namespace {

// Render and photo over the same background; where alpha is a mask, both black where it masks.
struct ComparedPair {
    ImageF shown, truth;
    std::vector<bool> counts;  // empty: every pixel does
    double share = 1;          // of the pixels that count
};

ComparedPair compared_pair(const ImageF& render, const ImageU8& photo, const glm::vec3& background,
                           bool alpha_is_mask) {
    ComparedPair pair{render, composite(photo, background), {}};
    if (!alpha_is_mask) return pair;
    const size_t pixels = size_t(photo.width) * photo.height;
    size_t counted = 0;
    for (size_t p = 0; p < pixels; ++p) {
        const bool counts = photo.data[p * 4 + 3] >= 128;
        pair.counts.push_back(counts);
        counted += counts ? 1 : 0;
        for (size_t c = 0; c < 3; ++c) {
            pair.truth.data[p * 3 + c] = counts ? photo.data[p * 4 + c] / 255.0f : 0.0f;
            if (!counts) pair.shown.data[p * 3 + c] = 0.0f;
        }
    }
    pair.share = static_cast<double>(counted) / static_cast<double>(pixels);
    return pair;
}

}  // namespace

ViewMetrics compare_view(const std::string& name, const ImageF& render, const ImageU8& photo,
                         const glm::vec3& background, bool alpha_is_mask) {
    const ComparedPair pair = compared_pair(render, photo, background, alpha_is_mask);
    if (pair.share == 0) return {name, std::nan(""), std::nan("")};
    const double all = psnr(pair.shown, pair.truth);
    return {name, std::min(all + 10.0 * std::log10(pair.share), kEqual_db),
            ssim(pair.shown, pair.truth)};
}

double flip_of_view(const ImageF& render, const ImageU8& photo, const glm::vec3& background,
                    bool alpha_is_mask) {
    const ComparedPair pair = compared_pair(render, photo, background, alpha_is_mask);
    const ImageF map = flip_map(pair.shown, pair.truth);
    double sum = 0, count = 0;
    for (size_t p = 0; p < map.data.size(); ++p) {
        if (!pair.counts.empty() && !pair.counts[p]) continue;
        sum += map.data[p];
        ++count;
    }
    return count > 0 ? sum / count : std::nan("");
}

std::optional<DepthError> compare_depth(const ImageF& rendered, const ImageF& measured,
                                        double scale) {
    std::vector<double> errors;
    double sum = 0;
    for (size_t p = 0; p < measured.data.size(); ++p) {
        if (!(measured.data[p] > 0) || rendered.data[2 * p + 1] < kLeastCover) continue;
        errors.push_back(std::abs(rendered.data[2 * p] / scale - measured.data[p]));
        sum += errors.back();
    }
    if (errors.empty()) return std::nullopt;
    return DepthError{sum / static_cast<double>(errors.size()), median(std::move(errors))};
}

}  // namespace darb
