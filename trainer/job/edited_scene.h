// SPDX-License-Identifier: MIT
// The scene that a command line names, with its layers: a project, or a scene as one layer. It is
// read by scene_file.cpp.
#pragma once

#include <filesystem>

#include "engine/scene/project_file.h"
#include "engine/scene/splat_file.h"

namespace darb {

/// A project with its edits done, with a warning on stderr for files that changed since; any other
/// scene as load_scene reads it. load_scene of a project is its EditedScene::saved. Throws Error.
EditedScene load_edited_scene(const std::filesystem::path& path, SplatFile* facts = nullptr,
                              const StoredUnits& units = {});

}  // namespace darb
