// From a folder of photos to a data set: runs the installed colmap on the CPU, without a display.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/data/colmap_progress.h"

namespace darb {

/// How hard COLMAP looks. quick: fewer features. thorough: more and fainter ones, and cameras from
/// fewer matches.
enum class ColmapEffort { quick, usual, thorough };

struct ColmapRun {
    std::filesystem::path photos;      // a folder of PNG and JPEG files
    std::filesystem::path workspace;   // made where missing; holds the data set afterwards
    std::filesystem::path masks = {};  // a folder: no features where they are black; may be empty
    bool sequential = false;           // neighbours in name order only: for video frames
    bool single_camera = true;         // all photos by one camera at one zoom
    int max_image_size = 1600;         // px, of the undistorted photos
    std::size_t count = 0;             // of the photos; 0: not known
    ColmapEffort effort = ColmapEffort::usual;  // to begin with
    bool quick_sequential = false;              // as sequential, for the quick effort alone
    const std::atomic<bool>* stop = nullptr;    // set: colmap is ended and ColmapStopped thrown
};

/// What a run tells while it works; any may be empty.
struct ColmapReports {
    std::function<void(std::string_view)> line = {};  // what colmap prints
    std::function<void(std::string_view)> note = {};  // a sentence, or the command that begins
    /// After each change, and once a second. seconds: of this step. left: below 0 where not known.
    std::function<void(std::size_t step, const ColmapOutput& output, double seconds, double left)>
        progress = {};
};

/// run.stop was set. What was done is kept: the same run goes on from there.
struct ColmapStopped {};

/// A step of an attempt: the words of a command, without a shell's quotes.
using ColmapCommand = std::vector<std::string>;

/// What an installed version knows, from its help texts; empty: nothing was found out.
struct ColmapHelp {
    std::string extractor = {}, matcher = {}, mapper = {};
    /// Whether the GPU options have their new names.
    bool has_new_names() const;
};

/// Where the commands read and write.
struct ColmapPaths {
    std::filesystem::path database, models, model, dense;
};
/// All below run.workspace: database.db, sparse, sparse/0, dense.
ColmapPaths plain_paths(const ColmapRun& run);

/// The four commands, in order: feature_extractor, matcher, mapper, image_undistorter. Options that
/// only help are given where `help` lists them.
std::vector<ColmapCommand> colmap_commands(const ColmapRun& run, const ColmapPaths& paths,
                                           const ColmapHelp& help = {});

/// Runs them. Where fewer than kEnoughPhotos of the photos get a camera, or none, it tries again
/// with the next effort and keeps the model that holds the most photos. Returns the data set's
/// folder (workspace/dense, with images and sparse); its model is workspace/sparse, and all that
/// was printed is in workspace/colmap.log. What an earlier run left that was ended is used where
/// the options are the same. Throws Error: with the commands in its hint where colmap is not
/// installed, with the last lines printed where a command fails; ColmapStopped.
std::filesystem::path run_colmap(const ColmapRun& run, const ColmapReports& reports);

constexpr double kEnoughPhotos = 0.8;  // a share

/// The effort that made workspace/sparse; usual where it is not known.
ColmapEffort effort_of_colmap(const std::filesystem::path& workspace);

/// Name of the model below `sparse` with the most images, the first of equals; empty where there is
/// none.
std::string largest_colmap_model(const std::filesystem::path& sparse);

/// In single quotes, for the shell.
std::string shell_quoted(const std::filesystem::path& path);

/// Whether the shell finds a program of that name.
bool is_installed(const std::string& program);

}  // namespace darb
