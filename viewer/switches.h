// SPDX-License-Identifier: MIT
// The switches whose time and error the viewer measures: presets, accuracy settings and effects.
// They are rows of one table, each with its choices.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "shaders/shared/effect_list.h"
#include "viewer/display.h"

namespace darb {

/// A row is an AccuracySettingId, effect_row() of an effect, or all settings at once:
inline constexpr int effect_row(int effect) {
    return kAccuracyCount + effect;
}
inline constexpr int kPresetRow = kAccuracyCount + EFFECT_COUNT;

inline constexpr std::array kAccuracyRows = {
    kPresetRow,        int{kEvaluation},        int{kFootprint},
    int{kAlphaCutoff}, int{kTransmittanceStop}, int{kStorage},
    int{kDepthOrder},  int{kRenderScale},       int{kSplatProjection}};
/// Only the effects of a view have a row; for the others the plan has no more than a reason.
inline constexpr bool has_effect_row(int effect) {
    for (const ProjectionSwitch& s : kProjectionSwitches)
        if (s.effect == effect) return true;
    return effect == EFFECT_VIEW_COLOUR || effect == EFFECT_HUGE;
}
inline constexpr std::size_t count_effect_rows() {
    std::size_t count = 0;
    for (int e = 0; e < EFFECT_COUNT; ++e) count += has_effect_row(e) ? 1 : 0;
    return count;
}
inline constexpr std::array kEffectRows = [] {
    std::array<int, count_effect_rows()> rows{};
    std::size_t count = 0;
    for (int e = 0; e < EFFECT_COUNT; ++e)
        if (has_effect_row(e)) rows[count++] = effect_row(e);
    return rows;
}();

std::string row_name(int row);
/// sh_degree: the highest of the scene.
std::vector<std::string> row_choices(int row, int sh_degree);
/// The choice in use; -1: none, where single settings differ from every preset.
int chosen(int row, const DisplaySettings& display);
void choose(int row, int choice, DisplaySettings& display);

}  // namespace darb
