// What people call a scene.
#pragma once

#include <filesystem>
#include <string>

namespace darb {

/// The output folder of the run that a file OUT/point_cloud/iteration_N/point_cloud.ply is of, by
/// its name alone, absolute; empty for any other file.
std::filesystem::path run_of_scene(const std::filesystem::path& file);

/// The name of the run that it is of; else that of its folder, where it is one, or of its file,
/// with or without the ending. "Scene" where there is no name.
std::string scene_name(const std::filesystem::path& path, bool with_ending = false);

}  // namespace darb
