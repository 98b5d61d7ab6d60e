// SPDX-License-Identifier: MIT
// A small .ksplat file, built by hand: two sections, the first with two splats (one full bucket of
// one splat, and one that is not full), the second with one splat.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace darb::test {

struct KsplatSplat {
    std::array<float, 3> position, scale;
    std::array<float, 4> rotation;  // w x y z
    std::array<std::uint8_t, 4> rgba;
};

constexpr std::array<KsplatSplat, 3> kKsplatSplats{
    {{{1.5f, -2, 0.25f}, {0.5f, 1, 2}, {1, 0, 0, 0}, {255, 0, 128, 51}},
     {{-1, 2, 3}, {0.125f, 0.25f, 4}, {0.5f, 0.5f, -0.5f, 0.5f}, {1, 2, 3, 200}},
     {{0, 0.5f, -0.75f}, {1, 1, 1}, {0, 0, 0, 1}, {10, 20, 30, 127}}}};

/// Coefficient-major, rgb innermost.
inline float ksplat_harmonic(std::size_t splat, std::size_t c) {
    return static_cast<float>(static_cast<int>((7 * c + 5 * splat) % 23) - 11) / 8;
}

/// For values that a half holds exactly, or nearly.
inline std::uint16_t ksplat_half(float value) {
    if (value == 0) return 0;
    int exponent = 0;
    const double mantissa = std::frexp(std::abs(value), &exponent);  // in [1/2, 1)
    const auto bits = static_cast<unsigned>(std::lround((2 * mantissa - 1) * 1024));
    return static_cast<std::uint16_t>((value < 0 ? 0x8000u : 0u) |
                                      (static_cast<unsigned>(exponent + 14) * 1024 + bits));
}

struct KsplatBytes {
    std::vector<std::byte> bytes;
    template <class T>
    void put(T value) {
        const auto raw = std::as_bytes(std::span(&value, 1));
        bytes.insert(bytes.end(), raw.begin(), raw.end());
    }
    template <class T>
    void set(std::size_t at, T value) {
        const auto raw = std::as_bytes(std::span(&value, 1));
        for (std::size_t i = 0; i < raw.size(); ++i) bytes[at + i] = raw[i];
    }
    void number(int level, float value) { level == 0 ? put(value) : put(ksplat_half(value)); }
};

constexpr double kKsplatBlock = 5, kKsplatRange = 32767;

inline void put_ksplat_splat(int level, int degree, std::size_t i, KsplatBytes& file) {
    const KsplatSplat& splat = kKsplatSplats[i];
    for (const float p : splat.position)  // every bucket's centre is 0.5
        level == 0 ? file.put(p)
                   : file.put(static_cast<std::uint16_t>(std::lround(
                         (p - 0.5) / (kKsplatBlock / 2 / kKsplatRange) + kKsplatRange)));
    for (const float s : splat.scale) file.number(level, s);
    for (const float q : splat.rotation) file.number(level, q);
    for (const std::uint8_t b : splat.rgba) file.put(b);
    for (int l = 1; l <= degree; ++l)
        for (int channel = 0; channel < 3; ++channel)
            for (int c = 0; c < 2 * l + 1; ++c) {
                const float h =
                    ksplat_harmonic(i, static_cast<std::size_t>(3 * (l * l - 1 + c) + channel));
                if (level == 2)
                    file.put(static_cast<std::uint8_t>(std::lround((h + 1.5) / 3 * 255)));
                else
                    file.number(level, h);
            }
}

/// level 0 to 2, degree 0 to 2.
inline std::vector<std::byte> ksplat_file(int level, int degree) {
    KsplatBytes file;
    file.bytes.resize(4096 + 2 * 1024);
    file.set<std::uint8_t>(1, 1);  // version 0.1
    for (const auto& [at, word] :
         {std::pair<std::size_t, std::uint32_t>{4, 2}, {8, 2}, {12, 3}, {16, 3}})
        file.set(at, word);
    file.set(20, static_cast<std::uint16_t>(level));
    const std::uint32_t splats[2] = {2, 1}, full[2] = {1, 0};
    for (std::size_t s = 0; s < 2; ++s) {
        const std::size_t head = 4096 + 1024 * s;
        const std::uint32_t buckets = level == 0 ? 0 : full[s] + 1, part = level == 0 ? 0 : 1;
        file.set(head, splats[s]);
        file.set(head + 4, splats[s] + 1);  // room for one that is not there
        file.set(head + 8, std::uint32_t{1});
        file.set(head + 12, buckets);
        file.set(head + 16, static_cast<float>(kKsplatBlock));
        file.set(head + 20, std::uint16_t{12});
        file.set(head + 24, static_cast<std::uint32_t>(kKsplatRange));
        file.set(head + 32, level == 0 ? 0u : full[s]);
        file.set(head + 36, part);
        file.set(head + 40, static_cast<std::uint16_t>(degree));
        if (part > 0) file.put(std::uint32_t{1});
        for (std::uint32_t i = 0; i < 3 * buckets; ++i) file.put(0.5f);
        for (std::size_t i = 0; i < splats[s]; ++i)
            put_ksplat_splat(level, degree, s == 0 ? i : 2, file);
        put_ksplat_splat(level, degree, 0, file);
    }
    return file.bytes;
}

}  // namespace darb::test
