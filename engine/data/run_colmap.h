// From a folder of photos to a data set: runs the installed colmap on the CPU, without a display.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

struct ColmapRun {
    std::filesystem::path photos;      // a folder of PNG and JPEG files
    std::filesystem::path workspace;   // made where missing; holds the data set afterwards
    std::filesystem::path masks = {};  // a folder: no features where they are black; may be empty
    bool sequential = false;           // neighbours in name order only: for video frames
    bool single_camera = true;         // all photos by one camera at one zoom
    int max_image_size = 1600;         // px, of the undistorted photos
    bool new_names = false;            // of the GPU options, in newer versions of COLMAP
    std::string model = "0";           // of the models that the mapper makes, the one to go on with
};

/// The shell commands, in order: feature_extractor, matcher, mapper, image_undistorter.
std::vector<std::string> colmap_commands(const ColmapRun& run);

/// Whether `colmap feature_extractor -h` printed the new names of the GPU options.
bool has_new_names(std::string_view help);

/// Runs them, passing on what they print line by line; new_names and model are found out, the model
/// being the one that holds the most photos. Returns the data set's folder
/// (workspace/dense, with images and sparse). Throws Error: with the commands in its hint where
/// colmap is not installed, with the last lines printed where a command fails.
std::filesystem::path run_colmap(const ColmapRun& run,
                                 const std::function<void(std::string_view line)>& progress);

/// Name of the model below `sparse` with the most images, the first of equals; empty where there is
/// none.
std::string largest_colmap_model(const std::filesystem::path& sparse);

/// In single quotes, for the shell.
std::string shell_quoted(const std::filesystem::path& path);

/// Whether the shell finds a program of that name.
bool is_installed(const std::string& program);

}  // namespace darb
