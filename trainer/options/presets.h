// SPDX-License-Identifier: MIT
// Lengths of a run by name: iterations and the width of the photos, for those who do not want to
// choose these.
#pragma once

#include <array>
#include <string_view>

namespace darb {

struct RunPreset {
    std::string_view name, summary;  // for people, a few words
    int iterations;
    int width;  // px, of the photos at most
};

/// The quickest first; the last is what a run without a preset is.
inline constexpr std::array<RunPreset, 3> kRunPresets{{
    {"preview", "minutes on most devices", 1'600, 400},
    {"good", "for most uses", 7'000, 800},
    {"full", "the length of 3DGS", 30'000, 1'600},
}};

/// nullptr: there is none of that name.
constexpr const RunPreset* run_preset(std::string_view name) {
    for (const RunPreset& preset : kRunPresets)
        if (preset.name == name) return &preset;
    return nullptr;
}

}  // namespace darb
