// The switches whose time and error the viewer measures: accuracy settings and effects, as rows of
// one table, each with its choices.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "viewer/display.h"

namespace darb {

/// A row is an AccuracySettingId, where footprint and SH degree are those of DisplaySettings, or:
inline constexpr int kAntialiasRow = kAccuracyCount;

inline constexpr std::array<int, 5> kAccuracyRows = {kEvaluation, kAlphaCutoff, kTransmittanceStop,
                                                     kStorage, kDepthOrder};
inline constexpr std::array<int, 3> kEffectRows = {kFootprint, kShDegree, kAntialiasRow};

std::string row_name(int row);
/// sh_degree: highest of the scene.
std::vector<std::string> row_choices(int row, int sh_degree);
int chosen(int row, const DisplaySettings& display);
void choose(int row, int choice, DisplaySettings& display);

}  // namespace darb
