// The cameras that a run ended with, where it refined them.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

/// Of views of the same name, at these views' sizes, from the cameras.json of the scene's run; a
/// note says so. Nothing happens where the run refined none. Throws Error where the file is not
/// what a run leaves.
void take_trained_cameras(const std::filesystem::path& scene, std::vector<View>& views);

}  // namespace darb
