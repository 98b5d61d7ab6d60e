// SPDX-License-Identifier: MIT
#include "viewer/switches.h"

#include <algorithm>
#include <iterator>

#include "engine/core/error.h"
#include "engine/plan/effect_plan.h"

namespace darb {

namespace {

/// The switch of an effect that is either on or off.
bool& on_off(int row, ProjectionEffects& effects) {
    const auto found =
        std::find_if(std::begin(kProjectionSwitches), std::end(kProjectionSwitches),
                     [&](const ProjectionSwitch& s) { return effect_row(s.effect) == row; });
    DARB_CHECK(found != std::end(kProjectionSwitches), "row {}", row);
    return effects.*found->on;
}

/// The footprint is no part of a preset, because another footprint shows another scene.
void choose_preset(int preset, Accuracy& accuracy) {
    const int footprint = accuracy.choice[kFootprint], degree = accuracy.choice[kShDegree];
    accuracy = preset_accuracy(preset);
    accuracy.choice[kFootprint] = footprint;
    accuracy.choice[kShDegree] = degree;
}

}  // namespace

std::string row_name(int row) {
    if (row == kPresetRow) return "preset";
    if (row >= kAccuracyCount) return std::string(effect_name(row - kAccuracyCount));
    return std::string(accuracy_settings()[static_cast<size_t>(row)].name);
}

std::vector<std::string> row_choices(int row, int sh_degree) {
    std::vector<std::string> names;
    if (row == kPresetRow) {
        for (int preset = 0; preset < kPresetCount; ++preset)
            names.emplace_back(preset_name(preset));
    } else if (row == effect_row(EFFECT_VIEW_COLOUR)) {
        for (int degree = 0; degree <= sh_degree; ++degree)
            names.push_back("degree " + std::to_string(degree));
    } else if (row == effect_row(EFFECT_HUGE)) {
        names = {"by counters", "always", "never"};
    } else if (row >= kAccuracyCount) {
        names = {"off", "on"};
    } else if (row == kFootprint) {
        names = {std::string(footprint_name(Footprint::psi)),
                 std::string(footprint_name(Footprint::exact))};
    } else {
        for (const AccuracyChoice& choice : accuracy_settings()[static_cast<size_t>(row)].choices)
            names.emplace_back(choice.name);
    }
    return names;
}

int chosen(int row, const DisplaySettings& display) {
    if (row == kPresetRow) {
        for (int preset = 0; preset < kPresetCount; ++preset) {
            Accuracy accuracy = display.accuracy;
            choose_preset(preset, accuracy);
            if (accuracy == display.accuracy) return preset;
        }
        return -1;
    }
    if (row == effect_row(EFFECT_VIEW_COLOUR)) return display.sh_degree;
    if (row == effect_row(EFFECT_HUGE)) return static_cast<int>(display.huge_splat_path);
    if (row == kFootprint) return display.footprint == Footprint::exact ? 1 : 0;
    if (row < kAccuracyCount) return display.accuracy.choice[static_cast<size_t>(row)];
    ProjectionEffects effects = display.effects;
    return on_off(row, effects) ? 1 : 0;
}

void choose(int row, int choice, DisplaySettings& display) {
    if (row == kPresetRow)
        choose_preset(choice, display.accuracy);
    else if (row == effect_row(EFFECT_VIEW_COLOUR))
        display.sh_degree = choice;
    else if (row == effect_row(EFFECT_HUGE))
        display.huge_splat_path = static_cast<HugeSplatPath>(choice);
    else if (row == kFootprint)
        display.footprint = choice == 1 ? Footprint::exact : Footprint::psi;
    else if (row < kAccuracyCount)
        display.accuracy.choice[static_cast<size_t>(row)] = choice;
    else
        on_off(row, display.effects) = choice == 1;
}

}  // namespace darb
