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

/// What one step has printed so far.
class ColmapOutput {
  public:
    /// photos: of the folder; 0: not known. pairs: that an exhaustive matcher compares, else 0.
    ColmapOutput(ColmapStep step, std::size_t photos, std::size_t pairs)
        : step_(step), photos_(photos), pairs_(pairs) {}

    /// A line, or the beginning of one that is not ended yet. Whether done() or total() changed.
    bool read(std::string_view line);

    /// Photos, or pairs of photos where unit() says so. total() is 0 until it is known.
    std::size_t done() const { return done_; }
    std::size_t total() const { return total_; }
    const char* unit() const {
        return step_ == ColmapStep::match && pairs_ > 0 ? "pairs" : "photos";
    }
    /// Of the mapper: which of its models the photos are being added to, from 1.
    std::size_t model() const { return model_; }
    /// Of the extractor: what it said of each photo, in its order.
    const std::vector<std::size_t>& features() const { return features_; }

  private:
    bool set(std::size_t done, std::size_t total);
    bool read_match(std::string_view text);
    bool read_map(std::string_view text);

    ColmapStep step_;
    std::size_t photos_, pairs_, done_ = 0, total_ = 0, model_ = 1;
    std::size_t parts_begun_ = 0, parts_ = 0;  // of the matcher: blocks, or photos
    std::vector<std::size_t> features_;
};

/// What is left of a step that took `seconds` for `done` of `total`; below 0: not known. The mapper
/// adjusts all photos again and again, so that each takes longer than the one before.
double colmap_seconds_left(ColmapStep step, double seconds, std::size_t done, std::size_t total);

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
