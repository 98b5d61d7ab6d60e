// SPDX-License-Identifier: MIT
// The command line of darb view, and how a viewer starts from it.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/darb/flags.h"
#include "tools/darb/tune_flags.h"
#include "viewer/viewer.h"

namespace darb {

struct ViewFlags {
    std::filesystem::path scene, cameras, screenshot, path, frames, times, mesh;
    std::vector<std::filesystem::path> more;  // scenes to add as layers
    std::string device, up, beside, size = "1280x720", show = "picture", style = "splats";
    std::string mesh_show = "both", mesh_look = "colours";
    int camera = -1, fps = 30;
    float gui_scale = 0;  // size of the panels; 0: the display's
    bool white_background = false, compare = false, difference = false, no_panels = false,
         quiet = false, force = false;
    std::vector<std::filesystem::path> kernel_files;
    AccuracyFlags accuracy;
    std::string effects = "auto";
    DatasetOptions data;
    TuneFlags tune;
    StoredUnits units;
};

void add_view_flags(CLI::App& command, ViewFlags& flags);
/// The data set of --cameras, otherwise cameras_beside the scene. Where those cannot be read there
/// are none, and `note` says why. Throws Error.
std::vector<View> find_views(const ViewFlags& flags, std::string& note);
/// Sets display, panels, path and camera. Throws Error.
void apply_flags(Viewer& viewer, const ViewFlags& flags, const PixelSize& size);

}  // namespace darb
