// SPDX-License-Identifier: MIT
#include "engine/data/compare_view.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/core/quantile.h"
#include "engine/data/metrics.h"

namespace darb {

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

ViewMetrics compare_view(const std::string& name, const ImageF& render, const ImageU8& photo,
                         const glm::vec3& background, bool alpha_is_mask) {
    ImageF truth = composite(photo, background);
    const auto finite_psnr = [&](const ImageF& image, double more) {
        return std::min(psnr(image, truth) + more, kEqual_db);
    };
    if (!alpha_is_mask) return {name, finite_psnr(render, 0), ssim(render, truth)};
    ImageF shown = render;
    const size_t pixels = size_t(photo.width) * photo.height;
    size_t counted = 0;
    for (size_t p = 0; p < pixels; ++p) {
        const bool counts = photo.data[p * 4 + 3] >= 128;
        counted += counts ? 1 : 0;
        for (size_t c = 0; c < 3; ++c) {
            truth.data[p * 3 + c] = counts ? photo.data[p * 4 + c] / 255.0f : 0.0f;
            if (!counts) shown.data[p * 3 + c] = 0.0f;
        }
    }
    if (counted == 0) return {name, std::nan(""), std::nan("")};
    const double share = static_cast<double>(counted) / static_cast<double>(pixels);
    return {name, finite_psnr(shown, 10.0 * std::log10(share)), ssim(shown, truth)};
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
