// What the reader and the writer of SPZ share.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace darb::spz {

constexpr std::uint32_t kMagic = 0x5053474e;                          // "NGSP"
constexpr std::size_t kOldHeader = 16, kHeader = 32, kTocEntry = 16;  // bytes
constexpr std::uint8_t kFlagAntialias = 1, kFlagExtensions = 2;
constexpr std::uint32_t kCoordinateSystem = 0xADBE0003;  // type of the extension
constexpr double kColourScale = 0.15;
constexpr int kRotationBits = 9;  // of a component's magnitude, where 511 is sqrt(1/2)

/// Bytes a splat of each attribute, in the order of the file.
struct Strides {
    std::array<std::size_t, 6> bytes;
    std::size_t total() const {
        std::size_t sum = 0;
        for (const std::size_t b : bytes) sum += b;
        return sum;
    }
};

/// degree 0..4
inline Strides strides(int version, int degree) {
    const auto coefficients = static_cast<std::size_t>((degree + 1) * (degree + 1) - 1);
    return {{version == 1 ? std::size_t{6} : std::size_t{9}, 1, 3, 3,
             version < 3 ? std::size_t{3} : std::size_t{4}, 3 * coefficients}};
}

}  // namespace darb::spz
