// SPDX-License-Identifier: MIT
// From a folder of photos to a data set: runs the installed colmap on the CPU, without a display.
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

enum class ColmapStep { extract, match, map, undistort };
constexpr std::size_t kColmapSteps = 4;

/// Follows what one step prints.
class ColmapOutput {
  public:
    /// photos: number of photos in the folder; 0: not known. pairs: number of pairs that an
    /// exhaustive matcher compares, else 0.
    ColmapOutput(ColmapStep step, std::size_t photos, std::size_t pairs)
        : step_(step), photos_(photos), pairs_(pairs) {}

    /// Reads a line, or the beginning of one that has not ended. Returns whether done() or total()
    /// changed.
    bool read(std::string_view line);

    /// In photos or pairs of photos, as unit() says. total() is 0 until it is known.
    std::size_t done() const { return done_; }
    std::size_t total() const { return total_; }
    const char* unit() const {
        return step_ == ColmapStep::match && pairs_ > 0 ? "pairs" : "photos";
    }
    /// Mapper only: which of its models the photos are being added to, from 1.
    std::size_t model() const { return model_; }
    /// Extractor only: the number of features it found in each photo, in its order.
    const std::vector<std::size_t>& features() const { return features_; }

  private:
    bool set(std::size_t done, std::size_t total);
    bool read_match(std::string_view text);
    bool read_map(std::string_view text);

    ColmapStep step_;
    std::size_t photos_, pairs_, done_ = 0, total_ = 0, model_ = 1;
    std::size_t parts_begun_ = 0, parts_ = 0;  // matcher only: blocks, or photos
    std::vector<std::size_t> features_;
};

/// Estimates the time left, in seconds, of a step that took `seconds` for `done` of `total`; below
/// 0: not known. The mapper adjusts all photos again and again, so that each takes longer than the
/// one before.
double colmap_seconds_left(ColmapStep step, double seconds, std::size_t done, std::size_t total);

/// How hard COLMAP tries. quick: fewer features. thorough: more and fainter ones, and cameras from
/// fewer matches.
enum class ColmapEffort { quick, usual, thorough };

constexpr double kEnoughPhotos = 0.8;  // share of the photos

struct ColmapRun {
    std::filesystem::path photos;      // a folder of PNG and JPEG files
    std::filesystem::path workspace;   // made where missing; holds the data set afterwards
    std::filesystem::path masks = {};  // a folder: no features where black; may be empty
    bool sequential = false;           // match only neighbours in name order: for video frames
    bool single_camera = true;         // all photos were taken by one camera at one zoom
    int max_image_size = 1600;         // the larger side of undistorted photos, px
    std::size_t count = 0;             // number of photos; 0: not known
    ColmapEffort effort = ColmapEffort::usual;  // the effort to begin with
    bool quick_sequential = false;              // match sequentially, but at the quick effort only
    std::filesystem::path pairs = {};           // a list of pairs of photos: match these alone
    // Photos that are known pinholes: squares of this many px that see 90 degrees. Their cameras
    // are taken as they are, and nothing is undistorted. 0: lenses are found, too.
    int pinhole = 0;
    double enough = kEnoughPhotos;            // of the photos, before it tries harder
    const std::atomic<bool>* stop = nullptr;  // when set: ends COLMAP, throws ColmapStopped
};

/// What a run reports while it works; any function may be empty.
struct ColmapReports {
    std::function<void(std::string_view)> line = {};  // a line that COLMAP printed
    std::function<void(std::string_view)> note = {};  // a sentence, or the command that begins
    /// Called after each change, and once a second. seconds: spent in this step. left: below 0
    /// where not known.
    std::function<void(std::size_t step, const ColmapOutput& output, double seconds, double left)>
        progress = {};
};

/// Thrown when run.stop was set. Finished work is kept, and the next run with the same options
/// continues from there.
struct ColmapStopped {};

/// One step of an attempt: the words of a command, without shell quotes.
using ColmapCommand = std::vector<std::string>;

/// The help texts of the installed version, which show what it knows; empty: not available.
struct ColmapHelp {
    std::string extractor = {}, matcher = {}, mapper = {};
    /// Whether the GPU options have the names of later versions.
    bool has_new_names() const;
};

/// Where the commands read and write.
struct ColmapPaths {
    std::filesystem::path database, models, model, dense;
};
/// All in run.workspace: database.db, sparse, sparse/0, dense.
ColmapPaths plain_paths(const ColmapRun& run);

/// The four commands, in order: feature_extractor, matcher, mapper, image_undistorter. Options that
/// COLMAP could do without are given only where `help` lists them.
std::vector<ColmapCommand> colmap_commands(const ColmapRun& run, const ColmapPaths& paths,
                                           const ColmapHelp& help = {});

/// Runs the commands. Where less than a share kEnoughPhotos of the photos get a camera, it tries
/// again with the next effort, and keeps the model that holds the most photos. Returns the data
/// set's folder (workspace/dense, with images and sparse), or with run.pinhole the model's; the
/// model is workspace/sparse, and everything that COLMAP printed is in workspace/colmap.log. What
/// an interrupted run left is used again where the options are equal. Throws Error with the
/// commands in its hint where COLMAP is not installed, or with the last printed lines where a
/// command fails; and ColmapStopped.
std::filesystem::path run_colmap(const ColmapRun& run, const ColmapReports& reports);

/// The effort that made workspace/sparse; usual where it is not known.
ColmapEffort effort_of_colmap(const std::filesystem::path& workspace);

/// The name of the model in `sparse` that has the most images, the first of equals; empty where
/// there is none.
std::string largest_colmap_model(const std::filesystem::path& sparse);

/// The path in single quotes, for a shell.
std::string shell_quoted(const std::filesystem::path& path);

}  // namespace darb
