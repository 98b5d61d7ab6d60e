// What a file that is no scene of 3DGS stores in the columns of one: scales that are no logarithms,
// opacities that are no logits, colours in place of harmonics, quaternions in another order. Such a
// file reads without an error and is drawn as fog. Here is what makes one of them right, and what
// tells from all of a scene's values that it may be one.
#pragma once

#include <string>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

enum class StoredScales { usual, logarithms, linear };  // usual: as the format has them
enum class StoredOpacities { logits, linear, bytes };   // linear: 0 to 1; bytes: 0 to 255
enum class StoredColours { harmonics, rgb, bytes };     // likewise
enum class StoredRotations { wxyz, xyzw };
enum class StoredOrder { usual, swapped };

/// What a user says of a file.
struct StoredUnits {
    StoredScales scales{};
    StoredOpacities opacities{};
    StoredColours colours{};
    StoredRotations rotations{};
    StoredOrder harmonics{};
    bool operator==(const StoredUnits&) const = default;
};

/// Sets right what `units` says. by_channel: the format has harmonics channel by channel, as PLY
/// does, so that `swapped` ones stand coefficient by coefficient; else the other way about. Throws
/// Error where the scene has values that cannot be what is said.
void apply_stored_units(const StoredUnits& units, bool by_channel, const std::string& where,
                        SplatModel& model);

/// What in a scene, as it was read, is unlike any scene, a sentence each with the option of darb
/// that reads it otherwise. A scene of fewer than 8 splats says too little. O(N).
std::vector<std::string> unit_doubts(const SplatModel& model, bool by_channel);

/// Whether positions are coarse beside the sizes of the splats, a sentence; else empty. step: of
/// the format's positions, world units; 0: that of float32 where the splats lie.
std::string position_doubt(const SplatModel& model, double step);

/// Of a format that stores lengths, and has some below 0.
inline constexpr const char* kScalesBelow0 =
    "has scales below 0, as logarithms are; --scales logarithms reads them as such";

/// Whether values were float32 once, though text may have them with fewer digits: no two of them
/// differ where float32 has them equal. Of many that lie closer than float32 resolves.
bool were_float32(std::vector<double> values);

/// The distance between float32 numbers at `value`.
double float32_step(double value);

}  // namespace darb
