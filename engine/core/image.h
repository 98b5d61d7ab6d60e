// SPDX-License-Identifier: MIT
// Image<T>: row-major, interleaved channels, top row first. data[(y * width + x) * channels + c].
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/core/error.h"

namespace darb {

template <class T>
struct Image {
    int width = 0;     // px
    int height = 0;    // px
    int channels = 0;  // 1 to 4
    std::vector<T> data;

    Image() = default;
    Image(int width_, int height_, int channels_)
        : width(width_),
          height(height_),
          channels(channels_),
          data(static_cast<size_t>(width_) * height_ * channels_) {}

    T& at(int x, int y, int c) { return data[index(x, y, c)]; }
    const T& at(int x, int y, int c) const { return data[index(x, y, c)]; }
    size_t index(int x, int y, int c) const {
        if (x < 0 || x >= width || y < 0 || y >= height || c < 0 || c >= channels) [[unlikely]]
            throw_outside(x, y, c);
        return (static_cast<size_t>(y) * width + x) * channels + c;
    }

  private:
    [[noreturn, gnu::cold, gnu::noinline]] void throw_outside(int x, int y, int c) const {
        throw Error("image",
                    fmt::format("({}, {}, {}) in {}x{}x{}", x, y, c, width, height, channels),
                    "Columns, rows and channels count from 0.");
    }
};

using ImageF = Image<float>;  // linear in [0, 1] where it holds a photo divided by 255
using ImageU8 = Image<std::uint8_t>;

}  // namespace darb
