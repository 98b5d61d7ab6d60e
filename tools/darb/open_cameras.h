// SPDX-License-Identifier: MIT
// Opens cameras and data sets for subcommands, and prints the readers' notes on stderr.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

/// Calls load_cameras and prints its notes.
std::vector<View> open_cameras(const std::filesystem::path& path,
                               const DatasetOptions& options = {});

/// The cameras.json that darb train left beside a scene, or those that a project names; empty where
/// there are none. Throws Error.
std::vector<View> cameras_beside(const std::filesystem::path& scene);

}  // namespace darb
