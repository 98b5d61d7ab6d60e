// SPDX-License-Identifier: MIT
// Training runs of several kernels on several data sets, side by side: what is read from their
// output folders, what is measured on their scenes, and the page that shows it all.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/hold_out.h"
#include "engine/gpu/device.h"
#include "engine/report/report.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "tools/paper/lpips.h"

namespace darb {

struct BlendStatistics {
    double blended_per_pixel = 0;  // splats with alpha at or above the cut-off, before the stop
    double intersections_per_splat = 0;  // splat-tile intersections over visible splats
    double blend_ms = 0;                 // forward blend pass per frame, median of the repeats
    double frame_ms = 0;                 // all forward passes
    double ns_per_splat_pixel = 0;       // blend_ms divided by splats blended over all pixels
};

/// Means over the cameras, of which there must be at least one. Counts come from the reference in
/// double, times from the device's timestamps (0 where it has none).
BlendStatistics measure_blending(Device& device, const SplatModel& model,
                                 const std::vector<Camera>& cameras, int repeats = 5);

struct ComparedView {
    std::string name;
    double psnr_db = 0, ssim = 0;
    std::optional<double> lpips;
    std::filesystem::path picture;  // photo | render | error, equal widths
    std::optional<double> flip = {};
};

struct ComparedScale {  // pictures of another size than that of training
    double scale = 1;   // factor on the sides
    double psnr_db = 0, ssim = 0;
};

struct ComparedAt {  // an evaluation of one run
    int iteration = 0;
    double seconds = 0;  // training time so far
    double psnr_db = 0, ssim = 0;
    std::optional<double> lpips, flip;
    double splats = 0;
    std::optional<double> model_mb;  // size of its PLY file, 10^6 bytes; empty where it was not
                                     // saved
    std::filesystem::path model;     // path of that file
    std::vector<ComparedView> views;
    std::vector<ComparedScale> scales;  // for each of --scales, where the model was saved
    std::optional<double> arc_db;       // PSNR of a held-out arc, where other views are held out,
                                        // too
    std::optional<double> off_path_db;  // PSNR away from the path of the cameras, where the data
                                        // set has such views
};

struct CurvePoint {
    int iteration = 0;
    double seconds = 0, loss = 0, splats = 0;
};

/// The exponents that splats are drawn with, for a kernel whose shape each splat learns.
struct LearnedShapes {
    static constexpr std::array kPercentiles = {1, 10, 50, 90, 99};
    std::vector<double> edges;        // edges of the bins, rising, one more than shares
    std::vector<double> shares;       // shares of the splats; their sum is 1
    std::vector<double> percentiles;  // kPercentiles of the exponents
};

struct ComparedRun {
    std::string kernel;  // its name, or that of a method that was not trained here
    bool trained_here = true;
    std::string machine;  // its device, in a merged comparison; else empty
    std::uint64_t seed = 0;
    std::filesystem::path folder;
    std::string failure;         // why it ended; empty where it finished
    std::string notes;           // sentences on what could not be read or measured; may be empty
    int exit_code = 0;           // the exit code that failure and notes call for
    std::vector<ComparedAt> at;  // by iteration; for a failed run, those that it reached
    std::vector<CurvePoint> curve;
    std::optional<double> peak_mb;  // peak of device memory over the whole run, 10^6 bytes
    std::optional<BlendStatistics> blending;
    std::optional<LearnedShapes> shapes;
};

struct ComparedDataset {
    std::string name;
    std::filesystem::path path;
    std::vector<ComparedRun> runs;  // by seed, then kernel
    std::string fingerprint = {};   // of photos, cameras and held-out views
    int width = 0, height = 0;      // of the first photo as it was used, px
};

struct Machine {
    std::string device, driver;
    bool operator==(const Machine&) const = default;
};

struct Comparison {
    std::vector<ComparedDataset> datasets;
    std::vector<std::string> kernels;  // names, in the order of the tables
    std::vector<std::string> added;    // those of them that were not trained here
    std::vector<int> iterations;       // ascending
    std::vector<double> scales;        // at which pictures were measured, besides that of training
    int seeds = 1;
    std::string settings;           // what the user asked for, as text
    std::vector<Machine> machines;  // one, or in a merged comparison several
    std::string device;             // all of them with their drivers, as text
    std::string lpips_note;         // which LPIPS, or why there is none
};

enum class RunState { none, partial, finished };

/// What the output folder of a training run holds, given the settings (settings_text) and the
/// list of cameras it should have. finished: metrics.json of a complete run. partial: only a
/// checkpoint. Throws Error where the folder has other settings, cameras, numbers of views, or
/// another choice of held-out views (hold_out_text).
RunState run_state(const std::filesystem::path& folder, const std::string& settings,
                   const std::string& cameras, int iterations, std::size_t held_out,
                   const std::string& hold_out = hold_out_text({}));

/// Fills at, curve and peak_mb from metrics.json and run.jsonl in run.folder, for those of
/// `iterations` that were evaluated, and adds notes about the others. Throws Error naming the file.
void read_run(ComparedRun& run, const std::vector<int>& iterations);

/// Fills them from run.jsonl alone, for a run that did not finish. Does nothing where the log is
/// missing, or belongs to other settings or cameras.
void read_unfinished_run(ComparedRun& run, const std::vector<int>& iterations,
                         const std::string& settings, const std::string& cameras);

/// The three parts of a held-out picture.
struct HeldOutPicture {
    ImageU8 photo, render;
};
HeldOutPicture read_held_out(const std::filesystem::path& picture);

std::string comparison_table(const Comparison& comparison);
nlohmann::json comparison_json(const Comparison& comparison);
/// Reads the held-out pictures of the first seed.
Report comparison_report(const Comparison& comparison);

// What a comparison measures on finished runs: LPIPS of held-out pictures, and blending.

/// LPIPS for one data set. Keeps the features of its photos as far as they fit into `room` bytes;
/// for a photo of 1.6 million px, they take 0.8 GB with VGG16.
class ViewLpips {
  public:
    explicit ViewLpips(const Lpips* lpips, std::size_t room = std::size_t{1} << 29)
        : lpips_(lpips), room_(room) {}  // lpips null: measures nothing
    /// Fills lpips of every view with a picture on disk, and the mean where every view has one.
    void measure(ComparedRun& run);

    std::size_t photos_kept() const { return photos_.size(); }

  private:
    double distance(const ComparedView& view, const HeldOutPicture& picture);

    const Lpips* lpips_;
    std::size_t room_;                             // bytes left
    std::map<std::string, LpipsFeatures> photos_;  // by view
};

/// Fills flip of every view with a picture on disk, and the mean where every view has one.
void measure_flip(ComparedRun& run);

/// Sets run.exit_code as main would for the exception: 2 for what the user can mend, else 1; a 1
/// stays.
void count_exception(const std::exception& e, ComparedRun& run);

/// Runs the measurement; an exception becomes a note that names it, and the run stays as it is.
void attempt(ComparedRun& run, const std::string& what, const std::function<void()>& measurement);

/// Sets run.blending from the last saved model, over at most `views` of the cameras.
void measure_blending_of(ComparedRun& run, Device& device, std::vector<Camera> cameras, int views);

}  // namespace darb
