// SPDX-License-Identifier: MIT
// SPZ, Niantic's format (github.com/nianticlabs/spz). Versions 1 to 3: one gzip stream of a 16-byte
// header and the attributes one after the other; version 4: a 32-byte header in the open, extension
// records, a table of sizes and one Zstandard frame an attribute. Attributes, in order:
//   position     3 x 24-bit fixed point with fractionalBits (version 1: 3 x float16)
//   opacity      uint8 / 255          colour  3 x uint8: dc = (c / 255 - 0.5) / 0.15
//   log scale    3 x uint8 / 16 - 10
//   rotation     x y z w: 3 x int8 of x y z with w >= 0 (versions 1, 2); the smallest three with 2
//   +
//                3 x (sign, 9 bits) from version 3 on
//   harmonics    (byte - 128) / 128, coefficient-major, rgb innermost; degree 0 to 4
// Axes are x right, y up, z backward, or as the extension 0xADBE0003 states; scenes in memory have
// x right, y down, z forward, as in PLY.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

/// Whether the bytes begin like SPZ: with the letters NGSP, or as gzip.
bool looks_like_spz(std::span<const std::byte> file);

struct SpzFacts {
    int version = 0;
    int sh_degree = 0;  // as stored; the model leaves out harmonics of degree 4
    int extensions = 0;
    double position_step = 0;     // world units; 0: as float16 has them
    bool extensions_cut = false;  // versions 1 to 3: the bytes after the attributes are not a
                                  // record
};

/// Throws Error naming what is wrong. Declared counts are checked against the file before
/// allocating.
SplatModel parse_spz(std::span<const std::byte> file, const std::string& where,
                     SpzFacts* facts = nullptr);

/// A writer may keep fewer steps of a harmonic's byte, which deflate better. Precision 0 is the
/// coarsest, that of the reference writer, with 5 bits for degree 1 and 4 bits above. Each further
/// precision halves the steps, and the last keeps all 8 bits.
constexpr int kSpzPrecisions = 5;
struct SpzSteps {
    int degree_1 = 1, higher = 1;  // in units of a harmonic's byte, of which 128 are 1
};
SpzSteps spz_steps(int precision);

/// version: 3 (one gzip stream, which more programs read) or 4. The error of a position is at most
/// 2^-(b+1), with b = 12 fractional bits, more for scenes under 32 across and fewer for those above
/// 2048; of a log scale 1/32 within [-10, 5.9]; of opacity 1/510; of dc 1/76.5 within [-3.33,
/// 3.33]; of a quaternion's component 7e-4; of a harmonic half of spz_steps / 128 within [-1, 1].
/// Keeps the render mode, but cannot store kernel and footprint. Throws Error(where, ...) where
/// positions do not fit 24 bits.
std::vector<std::byte> encode_spz(const SplatModel& model, const std::string& where = "scene",
                                  int version = 4, int precision = kSpzPrecisions - 1);
/// What lies outside these ranges, and the step of positions where it exceeds 2^-12; one sentence
/// each. Throws as encode_spz does.
std::vector<std::string> spz_losses(const SplatModel& model, const std::string& where = "scene");

}  // namespace darb

// What the reader and the writer of SPZ share.

namespace darb::spz {

constexpr std::uint32_t kMagic = 0x5053474e;                          // "NGSP"
constexpr std::size_t kOldHeader = 16, kHeader = 32, kTocEntry = 16;  // bytes
constexpr std::uint8_t kFlagAntialias = 1, kFlagExtensions = 2;
constexpr std::uint32_t kCoordinateSystem = 0xADBE0003;  // type number of the extension
constexpr double kColourScale = 0.15;
constexpr int kRotationBits = 9;  // bits of a component's magnitude, where 511 is sqrt(1/2)

/// Bytes per splat of each attribute, in file order.
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
