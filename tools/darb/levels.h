// SPDX-License-Identifier: MIT
// Fewer splats by merging, for `darb convert`: one file with a given count, or several levels, each
// refined against photos where they are given.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_model.h"
#include "tools/darb/outputs.h"

namespace darb {

struct LevelFlags {
    std::size_t splats = 0;       // splats of the first level; 0: by share
    std::optional<double> share;  // how many splats each level keeps of the previous one
    int levels = 0;               // 0: one file with the output's name
    std::filesystem::path refine;
    int iterations = 300;
    DatasetOptions data;
    bool asked() const { return splats > 0 || share || levels > 0; }
};

void add_level_options(CLI::App& app, LevelFlags& flags);
/// Throws Error for options that contradict each other.
void check_level_options(const LevelFlags& flags);

/// How many splats each level has, falling, at least 1.
std::vector<std::size_t> level_counts(const LevelFlags& flags, std::size_t splats);
/// The name of level n, from 1: the number stands before the ending of the format.
std::filesystem::path level_file(const std::filesystem::path& output, SplatFormat format, int n);

/// Merges the scene and writes its levels. Prints a row for each: splats, bytes, PSNR against the
/// scene in `views` and, with --refine, against the held-out photos before and after. --levels as
/// streamed SOG make one scene, with the model itself as the finest level. write: writes the model,
/// and the coarser levels of streamed SOG, to a file. Returns the names of the files. Throws Error.
struct LevelOutput {
    std::filesystem::path output;
    SplatFormat format = SplatFormat::ply;
    std::vector<View> views;
    std::string device;
    bool measure = true;  // false: the table has no PSNR against the scene
    std::FILE* say = stdout;
    std::function<EncodedSplats(const std::filesystem::path&, SplatModel&, std::vector<SplatModel>)>
        write;
};
Paths write_levels(const LevelFlags& flags, const SplatModel& model, const LevelOutput& to);

// How far two scenes differ in pictures.

struct SceneDifference {
    double mean_psnr_db = 0, worst_psnr_db = 0;
    std::string worst_view;
};

/// "41.20 dB mean over 8 views, 38.10 dB at worst (view 3)".
std::string difference_text(const SceneDifference& difference, std::size_t views);

/// Eight views around the splats, 480 x 360. Throws Error where there are none.
std::vector<View> views_around(const SplatModel& scene);

/// Renders both over black on the device (select: number or part of a name). Equal pictures count
/// as 100 dB.
SceneDifference compare_scenes(const SplatModel& scene, const SplatModel& other,
                               const std::vector<View>& views, const std::string& device);

}  // namespace darb
