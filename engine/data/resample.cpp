// SPDX-License-Identifier: MIT
#include "engine/data/resample.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/error.h"

namespace darb {

namespace {

std::uint8_t to_byte(float value) {
    return static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f));
}

/// Which source pixels a target pixel covers, and how much of each.
struct Coverage {
    int first = 0;
    std::vector<float> weight;  // sums to 1
};

std::vector<Coverage> cover(int source, int target) {
    std::vector<Coverage> all(static_cast<std::size_t>(target));
    const double step = static_cast<double>(source) / target;
    for (int i = 0; i < target; ++i) {
        Coverage& one = all[static_cast<std::size_t>(i)];
        const double begin = i * step, end = std::min<double>((i + 1) * step, source);
        one.first = std::min(static_cast<int>(begin), source - 1);
        for (int at = one.first; at < source && at < end; ++at) {
            const double covered = std::min(end, at + 1.0) - std::max<double>(begin, at);
            if (at > one.first && covered < 1e-9) break;
            one.weight.push_back(static_cast<float>(covered / step));
        }
    }
    return all;
}

/// One source row, premultiplied, reduced to the target's width: [width][4].
void reduce_row(const std::uint8_t* from, const std::vector<Coverage>& columns, float* to) {
    for (const Coverage& column : columns) {
        float sum[4] = {0, 0, 0, 0};
        const std::uint8_t* pixel = from + std::size_t{4} * static_cast<std::size_t>(column.first);
        for (const float weight : column.weight) {
            const float alpha = weight * static_cast<float>(pixel[3]);
            for (int c = 0; c < 3; ++c) sum[c] += alpha * static_cast<float>(pixel[c]);
            sum[3] += alpha;
            pixel += 4;
        }
        for (const float value : sum) *to++ = value;
    }
}

}  // namespace

ImageU8 to_rgba(ImageU8 image) {
    if (image.channels == 4) return image;
    ImageU8 rgba(image.width, image.height, 4);
    const auto channels = static_cast<std::size_t>(image.channels);
    const std::size_t pixels = image.data.size() / channels;
    for (std::size_t i = 0; i < pixels; ++i) {
        for (std::size_t c = 0; c < 3; ++c)
            rgba.data[i * 4 + c] = image.data[i * channels + (channels == 1 ? 0 : c)];
        rgba.data[i * 4 + 3] = 255;
    }
    return rgba;
}

namespace {

/// The values of a mask, 0 to 255. They are in its colour, where 0 and 1 may stand for 0 and 255.
/// Where the alpha channel varies, they are there; where the colour is black and white as well, in
/// both.
class MaskValues {
  public:
    explicit MaskValues(const ImageU8& mask)
        : mask_(mask), channels_(static_cast<std::size_t>(mask.channels)) {
        int least = 255, most = 0, clear = 255, opaque = 0;
        for (std::size_t i = 0; i + channels_ <= mask.data.size(); i += channels_) {
            const std::uint8_t* at = &mask.data[i];
            least = std::min<int>(least, at[0]);
            most = std::max<int>(most, at[0]);
            if (channels_ != 4) continue;
            clear = std::min<int>(clear, at[3]);
            opaque = std::max<int>(opaque, at[3]);
        }
        scale_ = most == 1 ? 255 : 1;
        by_alpha_ = clear < opaque;
        by_colour_ = !by_alpha_ || (least < most && is_black_and_white());
    }

    int at(std::size_t pixel) const {
        const std::uint8_t* at = &mask_.data[pixel * channels_];
        const int colour = by_colour_ ? scale_ * at[0] : 255;
        return by_alpha_ ? (colour * at[3] + 127) / 255 : colour;
    }

  private:
    bool is_black_and_white() const {
        constexpr int kNear = 8;
        for (std::size_t i = 0; i < mask_.data.size(); i += channels_)
            for (std::size_t c = 0; c < 3; ++c)
                if (mask_.data[i + c] > kNear && mask_.data[i + c] < 255 - kNear) return false;
        return true;
    }

    const ImageU8& mask_;
    std::size_t channels_;
    int scale_ = 1;
    bool by_alpha_ = false, by_colour_ = true;
};

}  // namespace

void apply_mask(ImageU8& rgba, const ImageU8& mask) {
    if (rgba.channels != 4 || mask.width <= 0 || mask.height <= 0)
        throw Error("mask",
                    fmt::format("cannot apply {}x{} px to a photo of {} channels", mask.width,
                                mask.height, rgba.channels),
                    "Use RGBA photos and masks that are not empty.");
    const MaskValues values(mask);
    for (int y = 0; y < rgba.height; ++y) {
        const auto v = static_cast<std::size_t>((y + 0.5) * mask.height / rgba.height);
        for (int x = 0; x < rgba.width; ++x) {
            const auto u = static_cast<std::size_t>((x + 0.5) * mask.width / rgba.width);
            const int value = values.at(v * static_cast<std::size_t>(mask.width) + u);
            std::uint8_t& alpha = rgba.data[(static_cast<std::size_t>(y) * rgba.width + x) * 4 + 3];
            alpha = static_cast<std::uint8_t>((alpha * value + 127) / 255);
        }
    }
}

ImageU8 box_downscale(const ImageU8& rgba, int width, int height) {
    if (rgba.channels != 4 || width < 1 || height < 1 || width > rgba.width || height > rgba.height)
        throw Error("downscale",
                    fmt::format("cannot turn {}x{}x{} into {}x{}", rgba.width, rgba.height,
                                rgba.channels, width, height),
                    "Use RGBA, and a size of at least 1 px and at most the photo's.");
    if (width == rgba.width && height == rgba.height) return rgba;
    const std::vector<Coverage> columns = cover(rgba.width, width);
    const std::vector<Coverage> rows = cover(rgba.height, height);
    const std::size_t row_values = std::size_t{4} * static_cast<std::size_t>(width);
    const std::size_t stride = std::size_t{4} * static_cast<std::size_t>(rgba.width);
    std::vector<float> reduced(row_values), sum(row_values);
    ImageU8 out(width, height, 4);
    int reduced_row = -1;  // neighbouring targets share a source row where sizes do not divide
    for (std::size_t y = 0; y < rows.size(); ++y) {
        std::fill(sum.begin(), sum.end(), 0.0f);
        for (std::size_t i = 0; i < rows[y].weight.size(); ++i) {
            const int source = rows[y].first + static_cast<int>(i);
            if (source != reduced_row)
                reduce_row(&rgba.data[static_cast<std::size_t>(source) * stride], columns,
                           reduced.data());
            reduced_row = source;
            const float weight = rows[y].weight[i];
            for (std::size_t k = 0; k < row_values; ++k) sum[k] += weight * reduced[k];
        }
        std::uint8_t* to = &out.data[y * row_values];
        for (std::size_t k = 0; k < row_values; k += 4) {
            const float alpha = sum[k + 3], scale = alpha > 0 ? 1 / alpha : 0;
            for (std::size_t c = 0; c < 3; ++c) to[k + c] = to_byte(sum[k + c] * scale);
            to[k + 3] = to_byte(alpha);
        }
    }
    return out;
}

}  // namespace darb
