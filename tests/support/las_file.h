// SPDX-License-Identifier: MIT
// A LAS file, put together for tests.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace darb::test {

struct LasPoint {
    std::array<std::int32_t, 3> at{};
    std::array<std::uint16_t, 3> colour{};
    bool withheld = false;
};

struct LasOptions {
    int minor = 2, format = 2;
    std::array<double, 3> scale{0.01, 0.01, 0.01}, offset{100, 200, -3};
};

inline std::vector<std::byte> las_file(const std::vector<LasPoint>& points,
                                       const LasOptions& options = {}) {
    constexpr std::array<std::size_t, 11> kBytes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
    constexpr std::array<std::size_t, 11> kColour{0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};
    const auto format = static_cast<std::size_t>(options.format);
    const std::size_t head = options.minor == 4 ? 375 : 227, record = kBytes[format] + 3;
    std::vector<std::byte> file(head + 5 + record * points.size());
    const auto put = [&](auto value, std::size_t at) {
        std::memcpy(file.data() + at, &value, sizeof value);
    };
    std::memcpy(file.data(), "LASF", 4);
    put(std::uint8_t{1}, 24);
    put(static_cast<std::uint8_t>(options.minor), 25);
    put(static_cast<std::uint16_t>(head), 94);
    put(static_cast<std::uint32_t>(head + 5), 96);
    put(static_cast<std::uint8_t>(options.format), 104);
    put(static_cast<std::uint16_t>(record), 105);
    const auto count = static_cast<std::uint32_t>(points.size());
    put(options.minor == 4 ? 0u : count, 107);
    if (options.minor == 4) put(std::uint64_t{count}, 247);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        put(options.scale[axis], 131 + 8 * axis);
        put(options.offset[axis], 155 + 8 * axis);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        const std::size_t begin = head + 5 + i * record;
        for (std::size_t k = 0; k < 3; ++k) put(points[i].at[k], begin + 4 * k);
        if (points[i].withheld) put(std::uint8_t(options.format < 6 ? 0x80 : 0x04), begin + 15);
        for (std::size_t k = 0; k < 3 && kColour[format] > 0; ++k)
            put(points[i].colour[k], begin + kColour[format] + 2 * k);
    }
    return file;
}

}  // namespace darb::test
