// SPDX-License-Identifier: MIT
// A scene in XGRIDS' LCC format, put together for tests: two units of the ground, two levels of
// detail, an environment; with or without harmonics.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/core/files.h"

namespace darb::test {

struct LccSplat {
    std::array<float, 3> position{};
    std::array<std::uint8_t, 4> colour{128, 64, 255, 204};  // r g b opacity
    std::array<std::uint16_t, 3> scale{0, 32768, 65535};
    std::uint32_t rotation = 3u << 30 | 512u << 20 | 512u << 10 | 512u;  // about none: w is largest
    std::uint32_t harmonic = 0;                                          // each of the 15
};

struct LccScene {
    std::filesystem::path folder;
    nlohmann::json meta;
    std::vector<std::byte> index, data, shcoef, environment;

    void write() const {
        const auto put = [&](const char* name, const std::vector<std::byte>& bytes) {
            write_file_atomic(folder / name, bytes);
        };
        put("Index.bin", index);
        put("data.bin", data);
        if (!shcoef.empty()) put("Shcoef.bin", shcoef);
        if (!environment.empty()) put("environment.bin", environment);
        write_file_atomic(folder / "meta.lcc", meta.dump());
    }
};

template <class T>
void append_le(T value, std::vector<std::byte>& to) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    to.insert(to.end(), bytes.begin(), bytes.end());
}

inline void append_lcc_splat(const LccSplat& s, std::vector<std::byte>& to) {
    for (const float p : s.position) append_le(p, to);
    for (const std::uint8_t c : s.colour) append_le(c, to);
    for (const std::uint16_t v : s.scale) append_le(v, to);
    append_le(s.rotation, to);
    for (int k = 0; k < 3; ++k) append_le(std::uint16_t{7}, to);  // a normal
}

inline void append_lcc_harmonics(const LccSplat& s, std::vector<std::byte>& to) {
    for (int c = 0; c < 15; ++c) append_le(s.harmonic, to);
    append_le(0u, to);
}

/// Units of 2 and 1 splats at level 0, and 1 and 0 at level 1; one splat far away. Positions are
/// (unit, splat, level); scales go from 0.5 to 1.5, harmonics from -1 to 1.
inline LccScene lcc_scene(const std::filesystem::path& folder, bool harmonics) {
    LccScene scene{folder, {}, {}, {}, {}, {}};
    constexpr std::uint32_t kCounts[2][2] = {{2, 1}, {1, 0}};  // [unit][level]
    for (std::uint32_t unit = 0; unit < 2; ++unit) {
        append_le(std::uint32_t{unit << 16}, scene.index);
        for (std::uint32_t level = 0; level < 2; ++level) {
            const std::uint32_t count = kCounts[unit][level];
            append_le(count, scene.index);
            append_le(std::uint64_t{scene.data.size()}, scene.index);
            append_le(32 * count, scene.index);
            for (std::uint32_t i = 0; i < count; ++i) {
                LccSplat splat;
                splat.position = {float(unit), float(i), float(level)};
                splat.harmonic = 2047u | 0u << 11 | 1024u << 21;
                append_lcc_splat(splat, scene.data);
                if (harmonics) append_lcc_harmonics(splat, scene.shcoef);
            }
        }
    }
    LccSplat far;
    far.position = {100, 100, 100};
    append_lcc_splat(far, scene.environment);
    if (harmonics) append_lcc_harmonics(far, scene.environment);
    const auto range = [](const char* name, double least, double most) {
        return nlohmann::json{
            {"name", name}, {"min", {least, least, least}}, {"max", {most, most, most}}};
    };
    scene.meta = {{"version", "5.0"},
                  {"totalSplats", 4},
                  {"totalLevel", 2},
                  {"cellLengthX", 10.0},
                  {"cellLengthY", 10.0},
                  {"indexDataSize", 36},
                  {"offset", {0, 0, 0}},
                  {"scale", {1, 1, 1}},
                  {"splats", {3, 1}},
                  {"encoding", "COMPRESS"},
                  {"fileType", harmonics ? "Quality" : "Portable"},
                  {"attributes",
                   {range("scale", 0.5, 1.5), range("shcoef", -1, 1), range("envscale", 10, 20),
                    range("envshcoef", -2, 2)}}};
    return scene;
}

}  // namespace darb::test
