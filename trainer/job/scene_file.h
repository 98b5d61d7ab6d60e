// SPDX-License-Identifier: MIT
// The scene that a command line names: a splat file, or the output folder of a training run.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "engine/data/dataset.h"
#include "engine/scene/splat_file.h"

namespace darb {

/// A splat file, the output folder of a training run or a SOG scene, rather than a data set.
bool is_scene(const std::filesystem::path& path);

/// Whether it looks like what a run can train on: a video, a folder of photos, or a data set. It
/// looks at names alone.
bool can_train_on(const std::filesystem::path& path);

/// path itself; of a folder with point_cloud/iteration_N/point_cloud.ply the one that its
/// metrics.json ends with, else of the largest N. Throws Error for a folder without one that is no
/// SOG scene either.
std::filesystem::path find_scene(const std::filesystem::path& path);

/// Where the run of an output folder ended; empty where there is none.
std::filesystem::path scene_of_run(const std::filesystem::path& output);

/// load_splats of find_scene(path), with a warning on stderr for what was dropped or left out.
SplatModel load_scene(const std::filesystem::path& path, SplatFile* facts = nullptr,
                      const StoredUnits& units = {});

/// Holds out what the command line says, else what the run did that wrote the scene, its output
/// folder or a file in it, else every eighth view; an arc is noted.
void hold_out_as_trained(const std::filesystem::path& scene, DatasetOptions& data);

/// The run.jsonl of the run that a scene is of, its output folder or a file in it; empty where
/// there is none.
std::filesystem::path log_of_run(const std::filesystem::path& scene);
/// Its last event of a start, as a run may go on; null where there is none.
nlohmann::json start_of_run(const std::filesystem::path& log);

}  // namespace darb
