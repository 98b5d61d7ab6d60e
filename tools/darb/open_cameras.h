// SPDX-License-Identifier: MIT
// Cameras and data sets as subcommands open them: with what the readers note on stderr.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

/// load_cameras, its notes printed.
std::vector<View> open_cameras(const std::filesystem::path& path,
                               const DatasetOptions& options = {});

/// The cameras.json that darb train left beside a scene; none where there is none. Throws Error.
std::vector<View> cameras_beside(const std::filesystem::path& scene);

}  // namespace darb
