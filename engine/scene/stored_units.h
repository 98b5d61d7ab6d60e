// SPDX-License-Identifier: MIT
// Files with the columns of a 3DGS scene but other contents: scales that are not logarithms,
// opacities that are not logits, colours instead of harmonics, quaternions in another order. Such a
// file can be read without an error, but looks like fog when drawn. This converts such values, and
// detects from all values of a scene that they may need it.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

enum class StoredScales { usual, logarithms, linear };  // usual: as the format defines
enum class StoredOpacities { logits, linear, bytes };   // linear: 0 to 1; bytes: 0 to 255
enum class StoredColours { harmonics, rgb, bytes };     // rgb: 0 to 1; bytes: 0 to 255
enum class StoredRotations { wxyz, xyzw };
enum class StoredOrder { usual, swapped };

/// What the user says about a file, and what of it to read.
struct StoredUnits {
    StoredScales scales{};
    StoredOpacities opacities{};
    StoredColours colours{};
    StoredRotations rotations{};
    StoredOrder harmonics{};
    /// The level of detail to read of a format that has levels, 0 being the finest; absent: 0.
    std::optional<std::size_t> level = {};
    bool operator==(const StoredUnits&) const = default;
};

/// Converts the values as `units` says. by_channel: the format stores harmonics channel by channel,
/// as PLY does, so that `swapped` ones are stored coefficient by coefficient; otherwise the
/// reverse. Throws Error where the scene has values that contradict `units`.
void apply_stored_units(const StoredUnits& units, bool by_channel, const std::string& where,
                        SplatModel& model);

/// What is unlike a 3DGS scene in the values as they were read, one sentence each, with the
/// option of darb that reads them otherwise. Scenes with fewer than 8 splats are not judged. O(N).
std::vector<std::string> unit_doubts(const SplatModel& model, bool by_channel);

/// A sentence where positions are coarse compared with the sizes of the splats; else empty. step:
/// that of the format's positions, world units; 0: that of float32 where the splats lie.
std::string position_doubt(const SplatModel& model, double step);

/// For formats that store lengths, where some are below 0.
inline constexpr const char* kScalesBelow0 =
    "has scales below 0, as logarithms are; --scales logarithms reads them as such";

/// Whether values may have been float32, although text may give them with fewer digits: no two
/// different values are equal as float32. Meaningful for many values that lie closer together than
/// float32 resolves.
bool were_float32(std::vector<double> values);

/// The distance from `value` to the next float32 number.
double float32_step(double value);

}  // namespace darb
