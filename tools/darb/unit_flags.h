// How a file stores its splats, where it does so in another way than its format.
#pragma once

#include <CLI/CLI.hpp>

#include "engine/scene/stored_units.h"

namespace darb {

/// --scales, --opacities, --colours, --rotations and --harmonics: how the file stores its splats.
/// with_scales: false where the command has another option --scales, which takes its words, too.
void add_unit_options(CLI::App& command, StoredUnits& units, bool with_scales = true);

}  // namespace darb
