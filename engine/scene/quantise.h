// SPDX-License-Identifier: MIT
// What the small splat formats share: numbers with few bits, opacity and colour in one byte, and
// quaternions without their largest component.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "engine/scene/sh_basis.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Rounds to the nearest of 0 .. 255.
inline std::uint8_t nearest_byte(double value) {
    return static_cast<std::uint8_t>(std::clamp(std::round(value), 0.0, 255.0));
}

/// The opacity byte / 255 as a logit; 0 and 255 become finite logits by limit_infinite_logit.
inline float logit_of_byte(std::uint8_t byte) {
    const double alpha = byte / 255.0;
    return limit_infinite_logit(static_cast<float>(std::log(alpha) - std::log1p(-alpha)));
}
inline std::uint8_t byte_of_logit(double logit) {
    return nearest_byte(255 / (1 + std::exp(-logit)));
}

/// The log scale as the passes clamp it.
inline float drawn_log_scale(float log_scale) {
    constexpr auto limit = static_cast<float>(LOG_SCALE_LIMIT);
    return std::clamp(log_scale, -limit, limit);
}

/// The colour in [0, 1] of a dc coefficient.
inline double colour_of_dc(double dc) {
    return 0.5 + kShBand0 * dc;
}
inline double dc_of_colour(double colour) {
    return (colour - 0.5) / kShBand0;
}

inline std::size_t count_outside(std::span<const float> values, double low, double high) {
    return static_cast<std::size_t>(
        std::ranges::count_if(values, [&](float v) { return v < low || v > high; }));
}

/// A unit quaternion without its largest component, which is taken to be positive.
struct SmallestThree {
    std::size_t largest = 0;
    std::array<double, 3> others{};  // in order, each in [-sqrt(1/2), sqrt(1/2)]
};

/// q: its components in any fixed order. The result is meaningless where q has no length;
/// encode_splats leaves such splats out.
inline SmallestThree smallest_three(const std::array<double, 4>& q) {
    SmallestThree result;
    double square = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        square += q[i] * q[i];
        if (std::abs(q[i]) > std::abs(q[result.largest])) result.largest = i;
    }
    if (!(square > 0)) return result;
    const double scale = (q[result.largest] < 0 ? -1 : 1) / std::sqrt(square);
    for (std::size_t i = 0, at = 0; i < 4; ++i)
        if (i != result.largest) result.others[at++] = q[i] * scale;
    return result;
}

inline std::array<double, 4> whole_quaternion(const SmallestThree& three) {
    std::array<double, 4> q{};
    double square = 0;
    for (std::size_t i = 0, at = 0; i < 4; ++i) {
        if (i == three.largest) continue;
        q[i] = three.others[at++];
        square += q[i] * q[i];
    }
    q[three.largest] = std::sqrt(std::max(0.0, 1 - square));
    return q;
}

/// Reads a little-endian value at byte `at`; the caller checks the length.
template <class T>
T load_le(std::span<const std::byte> bytes, std::size_t at) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

// Reads the float16 numbers of files as float32.

/// IEEE 754 binary16.
inline float half_to_float(std::uint16_t bits) {
    const int exponent = (bits >> 10) & 31, mantissa = bits & 1023;
    const double sign = bits & 0x8000 ? -1 : 1;
    if (exponent == 31) return static_cast<float>(mantissa ? NAN : sign * INFINITY);
    return static_cast<float>(exponent ? sign * std::ldexp(1024 + mantissa, exponent - 25)
                                       : sign * std::ldexp(mantissa, -24));
}

// The order of splats in a file in which chunks of consecutive splats share their bounds
// (compressed_ply.h): splats of a chunk lie close together. It is the Morton order with 10 bits per
// axis that splat-transform uses, so that its files keep their chunks when they are written again.
// Splats far off, which would coarsen other splats' chunks, come last.

/// model: finite positions; chunk: number of splats in one.
std::vector<std::uint32_t> chunk_order(const SplatModel& model, std::size_t chunk);

}  // namespace darb
