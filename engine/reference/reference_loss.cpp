// SPDX-License-Identifier: MIT
#include "engine/reference/reference_loss.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "engine/core/error.h"
#include "shaders/shared/loss_args.h"

namespace darb::reference {
namespace {

constexpr int kRadius = 5;  // window 11
constexpr double kSigma = 1.5;

std::array<double, 2 * kRadius + 1> window() {
    std::array<double, 2 * kRadius + 1> weights;
    double sum = 0;
    for (int i = -kRadius; i <= kRadius; ++i) {
        weights[i + kRadius] = std::exp(-i * i / (2 * kSigma * kSigma));
        sum += weights[i + kRadius];
    }
    for (double& weight : weights) {
        weight /= sum;
    }
    return weights;
}

/// Convolution with the window along one axis, zero outside. The window is symmetric, so this is
/// its own adjoint.
template <class T>
Image<T> blur_axis(const Image<T>& in, int step_x, int step_y) {
    static const auto weights = window();
    Image<T> out(in.width, in.height, in.channels);
    for (int y = 0; y < in.height; ++y) {
        for (int x = 0; x < in.width; ++x) {
            for (int i = -kRadius; i <= kRadius; ++i) {
                const int from_x = x + i * step_x, from_y = y + i * step_y;
                if (from_x < 0 || from_x >= in.width || from_y < 0 || from_y >= in.height) {
                    continue;
                }
                const size_t from = in.index(from_x, from_y, 0), to = out.index(x, y, 0);
                for (int c = 0; c < in.channels; ++c) {
                    out.data[to + c] += T(weights[i + kRadius]) * in.data[from + c];
                }
            }
        }
    }
    return out;
}

template <class T>
Image<T> blur(const Image<T>& in) {
    return blur_axis(blur_axis(in, 1, 0), 0, 1);
}

template <class T>
Image<T> product(const Image<T>& a, const Image<T>& b) {
    Image<T> out = a;
    for (size_t i = 0; i < out.data.size(); ++i) {
        out.data[i] *= b.data[i];
    }
    return out;
}

/// SSIM at one pixel and its derivatives by the window's moments of the image x (y is the truth).
template <class T>
struct SsimTerms {
    T value = 0;
    T d_mean = 0;     // by E[x], at fixed E[x x] and E[x y]
    T d_square = 0;   // by E[x x]
    T d_product = 0;  // by E[x y]
};

template <class T>
SsimTerms<T> ssim_terms(T mean_x, T mean_y, T square_x, T square_y, T mean_xy,
                        const LossSettings& settings) {
    const T c1 = T(settings.c1), c2 = T(settings.c2);
    const T variances = square_x - mean_x * mean_x + square_y - mean_y * mean_y;
    const T covariance = mean_xy - mean_x * mean_y;
    const T luminance = 2 * mean_x * mean_y + c1, structure = 2 * covariance + c2;
    const T below_l = mean_x * mean_x + mean_y * mean_y + c1, below_s = variances + c2;
    SsimTerms<T> terms;
    terms.value = (luminance / below_l) * (structure / below_s);
    terms.d_product = 2 * luminance / (below_l * below_s);
    terms.d_square = -terms.value / below_s;
    terms.d_mean = 2 * mean_y * structure / (below_l * below_s) -
                   2 * mean_x * terms.value / below_l - 2 * mean_x * terms.d_square -
                   mean_y * terms.d_product;
    return terms;
}

template <class T>
T weight_of(const Image<T>& weight, size_t sample) {
    return weight.data.empty() ? T(1) : weight.data[sample / 3];
}

/// Adds the SSIM part to the result: value, and scale * d(weighted SSIM sum)/d(image).
template <class T>
void add_ssim(const Image<T>& image, const Image<T>& truth, const LossSettings& settings,
              const Image<T>& weight, T scale, LossResult<T>& result) {
    const Image<T> mean_x = blur(image), mean_y = blur(truth);
    const Image<T> square_x = blur(product(image, image)), square_y = blur(product(truth, truth));
    const Image<T> mean_xy = blur(product(image, truth));
    Image<T> d_mean(image.width, image.height, 3), d_square = d_mean, d_product = d_mean;
    double sum = 0;
    for (size_t i = 0; i < image.data.size(); ++i) {
        const SsimTerms<T> terms = ssim_terms(mean_x.data[i], mean_y.data[i], square_x.data[i],
                                              square_y.data[i], mean_xy.data[i], settings);
        const T w = weight_of(weight, i);
        sum += static_cast<double>(w * terms.value);
        d_mean.data[i] = w * terms.d_mean;
        d_square.data[i] = w * terms.d_square;
        d_product.data[i] = w * terms.d_product;
    }
    result.ssim = sum / static_cast<double>(image.data.size());
    d_mean = blur(d_mean);
    d_square = blur(d_square);
    d_product = blur(d_product);
    for (size_t i = 0; i < image.data.size(); ++i) {
        result.d_image.data[i] += scale * (d_mean.data[i] + 2 * image.data[i] * d_square.data[i] +
                                           truth.data[i] * d_product.data[i]);
    }
}

}  // namespace

template <class T>
LossResult<T> loss(const Image<T>& image, const Image<T>& truth, const LossSettings& settings,
                   const Image<T>& weight) {
    if (image.channels != 3 || truth.channels != 3 || image.width != truth.width ||
        image.height != truth.height || image.data.empty())
        throw Error("loss",
                    fmt::format("{}x{}x{} and {}x{}x{}", image.width, image.height, image.channels,
                                truth.width, truth.height, truth.channels),
                    "Compare RGB pictures of one size.");
    if (!weight.data.empty() && weight.data.size() * 3 != image.data.size())
        throw Error("loss", fmt::format("got {} weights", weight.data.size()),
                    "Give one per pixel, or none.");
    LossResult<T> result;
    result.d_image = Image<T>(image.width, image.height, 3);
    const double count = static_cast<double>(image.data.size());
    const T l1_scale = T((1 - settings.lambda) / count);
    double l1_sum = 0, weight_sum = 0;
    for (size_t i = 0; i < image.data.size(); ++i) {
        const T difference = image.data[i] - truth.data[i];
        const T w = weight_of(weight, i);
        l1_sum += static_cast<double>(w * std::abs(difference));
        weight_sum += static_cast<double>(w);
        const T sign = T(difference > 0) - T(difference < 0);
        result.d_image.data[i] = l1_scale * w * sign;
    }
    result.l1 = l1_sum / count;
    add_ssim(image, truth, settings, weight, T(-settings.lambda / count), result);
    result.loss =
        (1 - settings.lambda) * result.l1 + settings.lambda * (weight_sum / count - result.ssim);
    return result;
}

template <class T>
Image<T> to_unit_range(const ImageU8& photo) {
    Image<T> out(photo.width, photo.height, photo.channels);
    for (size_t i = 0; i < photo.data.size(); ++i) {
        out.data[i] = T(photo.data[i]) / T(255);
    }
    return out;
}

#define DARB_INSTANTIATE(T)                                                            \
    template LossResult<T> loss(const Image<T>&, const Image<T>&, const LossSettings&, \
                                const Image<T>&);                                      \
    template Image<T> to_unit_range(const ImageU8&);
DARB_INSTANTIATE(double)
DARB_INSTANTIATE(float)
#undef DARB_INSTANTIATE

DistortionResult distortion(const BlendImages<double>& images, double weight,
                            const std::vector<bool>& left_out) {
    const Image<double>& t = images.transmittance;
    DistortionResult r{0, Image<double>(t.width, t.height, 1), Image<double>(t.width, t.height, 2)};
    for (std::size_t p = 0; p < t.data.size(); ++p) {
        const double w = 1 - t.data[p], sum = images.depth.data[p], square = images.square.data[p];
        if (!(w > 0) || (!left_out.empty() && left_out[p])) continue;
        const double depth = sum / w;
        const double pairs = 2 * (w * square - sum * sum) / (depth * depth);
        const double width = DISTORTION_WIDTH * DISTORTION_WIDTH;
        const double of_pixel = weight / static_cast<double>(t.data.size());
        const double by_pairs = of_pixel * width / ((pairs + width) * (pairs + width));
        const double share = 2 * by_pairs / (depth * depth);
        r.loss += of_pixel * pairs / (pairs + width);
        r.d_alpha.data[p] = share * square;
        r.d_depth.data[2 * p] = -2 * share * sum;
        r.d_depth.data[2 * p + 1] = share * w;
    }
    return r;
}

}  // namespace darb::reference
