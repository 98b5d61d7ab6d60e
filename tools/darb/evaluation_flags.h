// What is measured: which views are held out, at which sizes, and views off the path.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

/// --hold-out, which implies --eval.
CLI::Option* add_hold_out_flag(CLI::App& command, DatasetOptions& data);

/// --depth-scale: world units a metre of measured depths.
CLI::Option* add_depth_scale_flag(CLI::App& command, DatasetOptions& data);

/// --scales: sizes to measure at, as multiples of that of -r, each above 0.
CLI::Option* add_scales_flag(CLI::App& command, std::vector<double>& scales);

/// DATASET/off_path, a data set that is all held out, at the size of -r: pictures away from the
/// path of the photos. Without views where that folder has no transforms_test.json.
Dataset off_path_of(const std::filesystem::path& dataset, const DatasetOptions& options);

}  // namespace darb
